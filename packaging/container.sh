#!/bin/bash
# SPDX-License-Identifier: MIT
# A container image of Stirpoint from a Debian archive alone: no hub, no base image.
#
#     sudo packaging/container.sh PACKAGE.deb [IMAGE.tar]
#
# PACKAGE.deb is what `cpack -G DEB` made (docs/install.md). The image is a root file system:
#
#     docker import IMAGE.tar stirpoint && docker run -v "$PWD":/run stirpoint \
#       sh -c 'cd /run && mpirun --allow-run-as-root -n 4 stirpoint my.nml'
#     apptainer build stirpoint.sif ROOT    (with KEEP=ROOT in the environment: the folder is kept)
set -euo pipefail
(($# >= 1)) || { sed -n '3,12s/^# \{0,1\}//p' "$0" >&2; exit 2; }
package=$(realpath "$1")
image=$(realpath -m "${2:-stirpoint.tar}")
mirror=${MIRROR:-http://deb.debian.org/debian}
root=${KEEP:-$(mktemp -d)}
debootstrap --variant=minbase bookworm "$root" "$mirror"
cp "$package" "$root/tmp/stirpoint.deb"
chroot "$root" /bin/sh -ec 'export DEBIAN_FRONTEND=noninteractive
  apt-get update && apt-get install -y --no-install-recommends /tmp/stirpoint.deb
  rm -rf /tmp/stirpoint.deb /var/lib/apt/lists/* && apt-get clean'
chroot "$root" stirpoint --version
tar -C "$root" --one-file-system -cf "$image" .
[[ -n ${KEEP:-} ]] || rm -rf "$root"
echo "image: $image"
