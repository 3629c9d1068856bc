#!/bin/sh
# Builds the image of packaging/Dockerfile: by Docker, Podman, Buildah or Apptainer, the first that works; else its commands
# in a chroot of Debian 12 (as root, with debootstrap). Buildah needs no service: where no registry of images answers it
# begins with a Debian 12 that debootstrap makes, and then runs the demonstration in the image.
#    packaging/check.sh [DIRECTORY]     (of the chroot, or of Debian for Buildah: /var/tmp/gimp3d-bookworm)
#    packaging/check.sh --apptainer [DIRECTORY]    packaging/gimp3d.def: by Apptainer where it works, else its sections
#                                                  one by one in a container of Buildah
set -eu
cd "$(dirname "$0")/.."
apptainer=false
if [ "${1:-}" = --apptainer ]; then apptainer=true; shift; fi
directory=${1:-/var/tmp/gimp3d-bookworm}
base=docker.io/library/debian:bookworm-slim

# The base image: from a registry, else made by debootstrap
pull_base() {
   export BUILDAH_ISOLATION=chroot STORAGE_DRIVER=vfs
   if buildah inspect --type image $base >/dev/null 2>&1 || timeout 60 buildah pull -q $base; then return; fi
   echo 'No registry answers: Debian 12 by debootstrap'
   mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Label: Debian' 'Component: main' | head -n 1)
   [ -d "$directory/usr" ] || debootstrap --variant=minbase bookworm "$directory" "$mirror"
   container=$(buildah from scratch)
   tar -C "$directory" -c . >"$directory.tar"
   buildah add -q "$container" "$directory.tar" /
   buildah commit -q "$container" $base
   buildah rm "$container" >/dev/null
   rm "$directory.tar"
}

# What stands in a section of the recipe of Apptainer
section() {
   sed -n "/^%$1\$/,/^%/{/^%/!p}" packaging/gimp3d.def
}

if $apptainer; then
   command -v apptainer >/dev/null && exec apptainer build --force gimp3d.sif packaging/gimp3d.def
   echo 'Apptainer is not there: the sections of its recipe in a container of Buildah'
   pull_base
   container=$(buildah from --pull-never $base)
   section files | while read -r from to; do
      buildah copy -q --contextdir "$PWD" --ignorefile .dockerignore "$container" "$PWD/$from" "$to"
   done
   buildah run "$container" sh -ec "$(section post)"
   buildah run "$container" sh -ec "$(section test)"
   run=$(section runscript)
   buildah run "$container" sh -c "$run" gimp3d --version
   buildah run "$container" sh -c "cd /tmp && $run" gimp3d /usr/local/share/gimp3d/input/hertz.nml
   exec buildah rm "$container"
fi
for engine in docker podman; do
   if command -v $engine >/dev/null && $engine info >/dev/null 2>&1; then
      exec $engine build -t gimp3d -f packaging/Dockerfile .
   fi
done
if command -v buildah >/dev/null; then
   pull_base
   buildah bud --pull-never -t gimp3d -f packaging/Dockerfile .
   container=$(buildah from --pull-never gimp3d)
   buildah run "$container" sh -c 'mpirun -n 2 gimp3d </usr/local/share/gimp3d/input/demo.nml && gimp3d-post plots out/demo'
   exec buildah rm "$container"
fi
command -v apptainer >/dev/null && exec apptainer build --force gimp3d.sif packaging/gimp3d.def
echo 'No container engine works here: the commands of the Dockerfile in a chroot'
commands=$(sed -n 's/^RUN //p' packaging/Dockerfile | sed 's/cd \/gimp3d && //; s/ DESTDIR=\/image//; s/ && rm -rf .*//' | sed '$!s/$/ \&\&/')
exec test/systems/chroot.sh bookworm "$directory" sh -c "$commands"
