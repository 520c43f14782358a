#!/bin/sh
# Makes a Debian package of the programs that `cargo build --release` has made, with manual pages, completions and the
# daemon's units. Needs dpkg-deb and binutils.
#
#   deploy/deb.sh [FOLDER]      writes FOLDER/uwguide_VERSION_ARCH.deb (default: target) and tells its name. MAINTAINER='NAME <ADDRESS>' says who
#                               answers for it.
#
# For `uwguide --ros2` make them with `cargo build --release --features uw-daemon/ros2`.
#
# The service is installed and not enabled: it needs /etc/uwguide/profile.json of one's own water (docs/daemon.md).
set -eu
cd "$(dirname "$0")/.."
output=${1:-target}
built=target/release
for program in uw uwguide viewer; do
    if [ ! -x "$built/$program" ]; then
        echo "deb.sh: $built/$program is not there; run: cargo build --release" >&2
        exit 2
    fi
done

version=$("$built/uw" --version | cut -d ' ' -f 2)
architecture=$(dpkg --print-architecture)
root=$(mktemp -d)
trap 'rm -rf "$root"' EXIT
chmod 755 "$root"

# The window's name is too common for a system's path.
mkdir -p "$root/usr/bin"
install -m 755 "$built/uw" "$built/uwguide" "$root/usr/bin/"
install -m 755 "$built/viewer" "$root/usr/bin/uw-viewer"
# What the programs need of the C library, before their symbols go.
libc=$(objdump -T "$root"/usr/bin/* | grep -o 'GLIBC_[0-9.]*' | sort -V | tail -n 1 | cut -d _ -f 2)
strip "$root"/usr/bin/*

man=$root/usr/share/man/man1
"$root/usr/bin/uw" man --output "$man"
"$root/usr/bin/uwguide" man >"$man/uwguide.1"
gzip -9 -n "$man"/*

share=$root/usr/share
mkdir -p "$share/bash-completion/completions" "$share/zsh/vendor-completions" "$share/fish/vendor_completions.d"
for program in uw uwguide; do
    "$root/usr/bin/$program" completions bash >"$share/bash-completion/completions/$program"
    "$root/usr/bin/$program" completions zsh >"$share/zsh/vendor-completions/_$program"
    "$root/usr/bin/$program" completions fish >"$share/fish/vendor_completions.d/$program.fish"
done

units=$root/usr/lib/systemd/system
mkdir -p "$units"
for unit in service socket; do
    sed 's#/usr/local/bin/#/usr/bin/#g' "deploy/uwguide.$unit" >"$units/uwguide.$unit"
done

# The message of `uwguide --ros2`, for the workspaces of those who listen.
mkdir -p "$share/uwguide/ros2"
cp -r ros2/uwguide_msgs "$share/uwguide/ros2/"

mkdir -p "$share/doc/uwguide" "$root/DEBIAN"
cp README.md CHANGELOG.md LICENSE LICENSE-MIT LICENSE-APACHE docs/daemon.md "$share/doc/uwguide/"
"$root/usr/bin/uwguide" --print-default-config >"$share/doc/uwguide/uwguide.toml"
find "$root/usr" -type d -exec chmod 755 {} +
find "$root/usr" -type f ! -path "*/usr/bin/*" -exec chmod 644 {} +

# Graphics are opened at run time where there are any.
cat >"$root/DEBIAN/control" <<CONTROL
Package: uwguide
Version: $version
Architecture: $architecture
Maintainer: ${MAINTAINER:-uwguide <root@localhost>}
Installed-Size: $(du -sk "$root/usr" | cut -f 1)
Depends: libc6 (>= $libc), libgcc-s1
Suggests: libvulkan1
Section: science
Priority: optional
Description: underwater images and advice for underwater vehicles
 A physically right renderer of underwater images (uw), the daemon that suggests
 distance and lamp level to a vehicle (uwguide), and a window (uw-viewer).
CONTROL
mkdir -p "$output"
package=$output/uwguide_${version}_${architecture}.deb
# Pictures are most of it and do not get smaller: no time is spent on trying.
dpkg-deb --root-owner-group -z1 --build "$root" "$package" >/dev/null
echo "$package"
