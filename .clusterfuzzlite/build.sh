#!/bin/bash -eu
# Builds the fuzz targets as ClusterFuzzLite expects them: programs, seed corpora, dictionaries.
cd "$SRC/framelock"
for target in $(cargo fuzz list); do
    cargo fuzz build --release --debug-assertions "$target"
    cp "fuzz/target/x86_64-unknown-linux-gnu/release/$target" "$OUT/"
    zip --junk-paths --quiet --recurse-paths "$OUT/${target}_seed_corpus.zip" "fuzz/corpus/$target"
    if [ -f "fuzz/$target.dict" ]; then
        cp "fuzz/$target.dict" "$OUT/"
    fi
done
