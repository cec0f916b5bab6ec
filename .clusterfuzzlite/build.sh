#!/bin/bash -eu
# Builds the fuzz targets for ClusterFuzzLite and OSS-Fuzz: programs, options, seed corpora, dictionaries.
cd "$SRC/framelock"
cargo fuzz build --release --debug-assertions
# Not `cargo fuzz list`: for coverage, the image runs `cargo build` instead of every `cargo fuzz`.
for source in fuzz/fuzz_targets/*.rs; do
    target=$(basename "$source" .rs)
    cp "fuzz/target/x86_64-unknown-linux-gnu/release/$target" "$OUT/"
    # The hosted fuzzers try all lengths at once, and long inputs are slow.
    printf '[libfuzzer]\nmax_len = 256\n' >"$OUT/$target.options"
    zip --junk-paths --quiet --recurse-paths "$OUT/${target}_seed_corpus.zip" "fuzz/corpus/$target"
    if [ -f "fuzz/$target.dict" ]; then
        cp "fuzz/$target.dict" "$OUT/"
    fi
done
