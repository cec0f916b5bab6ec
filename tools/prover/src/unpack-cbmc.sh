# Unpacks Debian's CBMC into the folder $1; nothing is installed in the system.
set -eu
release=trixie # It has the CBMC that Kani is built on, 6.x.
if [ "$(uname -sm)" != "Linux x86_64" ]; then
    echo "Debian's packages are used on x86-64 Linux only" >&2
    exit 1
fi
work=$1.new
rm -rf "$work"
mkdir -p "$work/lists/partial" "$work/cache/archives/partial" "$work/packages" "$work/unpacked"

# The mirror that this machine uses, else Debian's own. apt checks what it downloads against
# Debian's signatures.
mirror=$(sed -n 's|^URIs: *\([^ ]*/debian\)/*$|\1|p' /etc/apt/sources.list.d/* 2>/dev/null | head -n 1)
keyring=/usr/share/keyrings/debian-archive-keyring.gpg
signed=
if [ -e "$keyring" ]; then
    signed="[signed-by=$keyring]"
fi
echo "deb $signed ${mirror:-http://deb.debian.org/debian} $release main" > "$work/sources.list"
apt() {
    apt-get --quiet=2 \
        -o Dir::Etc::sourcelist="$work/sources.list" -o Dir::Etc::sourceparts=- \
        -o Dir::State::Lists="$work/lists" -o Dir::Cache="$work/cache" \
        -o APT::Sandbox::User=root -o Acquire::Languages=none "$@"
}
apt update
cd "$work/packages"
# The checker, its solver, and the libraries of that release that both need.
apt download cbmc minisat libc6 libstdc++6 libgcc-s1
for package in *.deb; do
    dpkg-deb --extract "$package" "$work/unpacked"
done

# Starts it through the loader of its own release, with that release's libraries.
libraries=$1/usr/lib/x86_64-linux-gnu
cat > "$work/unpacked/cbmc" <<END
#!/bin/sh
exec "$libraries/ld-linux-x86-64.so.2" --library-path "$libraries:$1/usr/lib" "$1/usr/bin/cbmc" "\$@"
END
chmod +x "$work/unpacked/cbmc"

# Half of it would be taken for all, so it gets its name last.
mv "$work/unpacked" "$1"
rm -rf "$work"
