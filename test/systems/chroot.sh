#!/bin/sh
# Builds the project and runs its tests under another release of Debian, in a chroot; as root, with debootstrap:
#    test/systems/chroot.sh RELEASE DIRECTORY [COMMAND...]
#    test/systems/chroot.sh trixie /var/tmp/trixie                                (make demo, then make test)
#    test/systems/chroot.sh trixie /var/tmp/trixie make test TESTS='unit input'
# The first call makes the chroot in DIRECTORY: the release from the mirror that apt of this machine has for it, with its
# names, its certificates and its settings of pip, and what tools/deps lists. Each call copies the sources there
# (those that git knows or would add), keeps what was built, and runs COMMAND in their directory.
#test: helper
set -eu

[ $# -ge 2 ] || { sed -n '2,8s/^# \{0,1\}//p' "$0" >&2; exit 2; }
release=$1 root=$2
shift 2
[ "$(id -u)" -eq 0 ] || { echo 'A chroot is made by root' >&2; exit 2; }
command -v debootstrap >/dev/null || { echo 'debootstrap is not there: apt-get install debootstrap' >&2; exit 2; }
cd "$(dirname "$0")/../.."

if [ ! -e "$root/complete" ]; then
   mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Label: Debian' 'Component: main' | head -n 1)
   [ "$mirror" ] || { echo 'apt knows no mirror of Debian: its lists are empty (apt-get update)' >&2; exit 2; }
   debootstrap --variant=minbase --include=ca-certificates,git,make "$release" "$root" "$mirror"
   cp /etc/hosts "$root/etc/hosts"
   for file in /etc/pip.conf /etc/apt/apt.conf /etc/apt/apt.conf.d/*proxy*; do
      [ ! -f "$file" ] || cp "$file" "$root$file"
   done
   for file in /usr/local/share/ca-certificates/*.crt; do
      [ ! -f "$file" ] || cp "$file" "$root$file"
   done
   chroot "$root" update-ca-certificates
   touch "$root/complete"
fi
cp -L /etc/resolv.conf "$root/etc/resolv.conf"

# Files that differ from those of the last call are copied with the present time, so that make sees them.
mkdir -p "$root/gimp3d" "$root/sources"
find "$root/sources" -mindepth 1 -delete
git ls-files -z --cached --others --exclude-standard | tar -c --null --ignore-failed-read -T - | tar -x -C "$root/sources"
(cd "$root/gimp3d" && find . -mindepth 1 \( -path ./build -o -path ./out \) -prune -o ! -type d -print) | while read -r file; do
   [ -e "$root/sources/$file" ] || rm -f "$root/gimp3d/$file"
done
(cd "$root/sources" && find . ! -type d -print) | while read -r file; do
   cmp -s "$root/sources/$file" "$root/gimp3d/$file" && continue
   mkdir -p "$root/gimp3d/$(dirname "$file")"
   cp -P "$root/sources/$file" "$root/gimp3d/$file"
done
[ $# -gt 0 ] || set -- sh -c 'make demo && make test'

# Mounts of its own, which end with the command; so does /tmp: processes have the numbers of the call before, and mpirun of
# Open MPI 5 ends at once, with 213 and no word, where one of its number has left its folder in /tmp.
exec unshare --kill-child --mount --pid --fork env root="$root" HOME=/root LC_ALL=C.UTF-8 \
   PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin sh -c '
   mount -t proc proc "$root/proc"
   mount --rbind /dev "$root/dev"
   [ ! -d /sys/fs ] || mount --rbind /sys "$root/sys"
   mount -t tmpfs tmpfs "$root/tmp"
   exec chroot "$root" sh -c "cd /gimp3d && sh tools/deps && exec \"\$@\"" sh "$@"' sh "$@"
