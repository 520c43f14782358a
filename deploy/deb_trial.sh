#!/bin/sh
# Installs a Debian package in a bare Debian, uses it and removes it: what it says that it needs must be enough.
#
#   deploy/deb_trial.sh PACKAGE.deb [SUITE]      as root; needs debootstrap and a Debian mirror. SUITE: bookworm. Ends with 3 where no
#                                                bare Debian can be made, so that nothing was tried.
set -eu
package=$1
suite=${2:-bookworm}
root=$(mktemp -d)
trap 'umount "$root/proc" 2>/dev/null || true; rm -rf "$root"' EXIT
debootstrap --variant=minbase "$suite" "$root" >"$root.log" 2>&1 || { tail "$root.log" >&2; rm -f "$root.log"; exit 3; }
rm -f "$root.log"
mount -t proc proc "$root/proc" || exit 3
cp "$package" "$root/tmp/package.deb"
# A command in there, whose words are shown when it fails.
inside() {
    chroot "$root" env -i PATH=/usr/bin:/usr/sbin:/bin:/sbin HOME=/root LANG=C.UTF-8 DEBIAN_FRONTEND=noninteractive sh -euc "$1" \
        >"$root/tmp/said" 2>&1 || { echo "deb_trial.sh: $1" >&2; tail "$root/tmp/said" >&2; exit 1; }
}

inside 'apt-get install -qy --no-install-recommends /tmp/package.deb'
inside 'cd /tmp && uw doctor && uw demo -o demo && test -s demo/report.md'
inside 'cd /tmp && uw render flat_hull -o hull.png --width 64 --spp 2 && test -s hull.png'
inside 'echo "{\"op\": \"health\"}" | uwguide --profile 1C --stdio | grep "\"ok\":true"'
inside 'test -s /usr/share/man/man1/uw.1.gz && test -s /usr/lib/systemd/system/uwguide.service'
inside 'apt-get remove -qy uwguide && ! command -v uw && ! test -e /usr/share/man/man1/uw.1.gz && ! test -e /usr/share/doc/uwguide'
echo "installed, used and removed in a bare $suite"
