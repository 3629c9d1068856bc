#!/bin/sh
# Builds gimp3d as packaging/Dockerfile does: by Docker, Podman or Apptainer where one works, else its commands in a
# chroot of Debian 12 (as root, with debootstrap).   packaging/check.sh [DIRECTORY]     (of the chroot: /var/tmp/gimp3d-bookworm)
set -eu
cd "$(dirname "$0")/.."
for engine in docker podman; do
   if command -v $engine >/dev/null && $engine info >/dev/null 2>&1; then
      exec $engine build -t gimp3d -f packaging/Dockerfile .
   fi
done
command -v apptainer >/dev/null && exec apptainer build --force gimp3d.sif packaging/gimp3d.def
echo 'No container engine works here: the commands of the Dockerfile in a chroot'
commands=$(sed -n 's/^RUN //p' packaging/Dockerfile | sed 's/cd \/gimp3d && //; s/ DESTDIR=\/image//; s/ && rm -rf .*//' | sed '$!s/$/ \&\&/')
exec test/systems/chroot.sh bookworm "${1:-/var/tmp/gimp3d-bookworm}" sh -c "$commands"
