#!/usr/bin/env bash
# A real Blender on a Debian machine, as root: Debian's package, in a chroot.
#   real_blender.sh install [DIR]       Blender 4.3 with Python 3.13, and Chromium (3 minutes, 2 GB)
#   real_blender.sh blender DIR ARGS    run that Blender; the current folder, the checkout, the
#                                       folder ../shared and Patina's cache have the same paths
#   real_blender.sh python DIR ARGS     run its Python 3.13 in the same way
#   real_blender.sh session DIR OUT     tools/window/session.py in a real window on a virtual screen:
#                                       screenshots of every stage in OUT (with the extension
#                                       that `run.py headless` installed)
#   real_blender.sh own DIR NAME OUT    tools/window/own_shoots.py: an own object by mouse, from the
#                                       folder NAME in the home folder's Scans, or "demo"
#   real_blender.sh ended DIR OUT       tools/window/ended_process.py: the process of a fit is ended
#   real_blender.sh looks DIR OUT       tools/window/looks.py: the sidebar of the .blend in OUT in both
#                                       themes, at twice the size, and in other languages
#   real_blender.sh chromium DIR ARGS   run Debian's Chromium; it sees the folder /tmp
# Debian's build has no OSL and no USD; these are tested with the bpy wheel.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

bind() { # DIR FOLDER
  [ -d "$2" ] || return 0
  mkdir -p "$1$2"
  mount --bind "$2" "$1$2"
}

system() { # DIR
  for m in proc dev; do mountpoint -q "$1/$m" || mount --bind "/$m" "$1/$m"; done
}

inside() { # DIR COMMAND ...
  DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8 chroot "$@"
}

install() { # DIR
  local dir=$1 mirror
  if [ ! -x "$dir/usr/bin/blender" ]; then
    mirror=$(cat /etc/apt/sources.list /etc/apt/sources.list.d/debian.sources 2>/dev/null |
      sed -nE 's/^(URIs: |deb (\[[^]]*\] )?)([^ ]+).*/\3/p' | sed -n 1p) || true
    [ -n "$mirror" ] || { echo "no Debian mirror found in /etc/apt" >&2; exit 1; }
    command -v debootstrap >/dev/null || { apt-get update -qq; apt-get install -y -qq debootstrap >/dev/null; }
    debootstrap --variant=minbase trixie "$dir" "$mirror" >/dev/null
    cp -n /etc/apt/apt.conf.d/* "$dir/etc/apt/apt.conf.d/" 2>/dev/null || true
    cp /etc/resolv.conf /etc/hosts "$dir/etc/"
    system "$dir"
    inside "$dir" apt-get update -qq
    inside "$dir" apt-get install -y -qq --no-install-recommends \
      blender python3-numpy python3-requests python3-cattr libgl1-mesa-dri >/dev/null
  fi
  system "$dir"
  # Debian's package only recommends numpy, which the extension requires.
  inside "$dir" python3 -c 'import numpy' 2>/dev/null || {
    inside "$dir" apt-get update -qq
    inside "$dir" apt-get install -y -qq --no-install-recommends python3-numpy >/dev/null
  }
  [ -x "$dir/usr/bin/chromium" ] || {
    inside "$dir" apt-get update -qq
    inside "$dir" apt-get install -y -qq --no-install-recommends chromium fonts-dejavu-core >/dev/null
  }
  inside "$dir" blender -b --version | sed -n 1p
}

what=${1:-}
# All mounts are in a private namespace and disappear when this script ends. Otherwise, deleting the
# folder with /dev still mounted in it would delete the files of the host's /dev.
if [ "${IN_NAMESPACE:-}" != 1 ] && [ -n "$what" ]; then
  IN_NAMESPACE=1 exec unshare --mount bash "${BASH_SOURCE[0]}" "$@"
fi
unset IN_NAMESPACE
shift || true
case $what in
install) install "${1:-/opt/blender-trixie}" ;;
blender | python)
  program=blender
  [ "$what" = blender ] || program=python3
  dir=$1; shift
  system "$dir"
  bind "$dir" "$here"
  bind "$dir" "$(dirname "$here")/shared"
  bind "$dir" "${PATINA_CACHE:-${XDG_CACHE_HOME:-$HOME/.cache}/patina}"
  bind "$dir" "$PWD"
  exec chroot "$dir" /bin/bash -c 'cd "$0" && exec "$@"' "$PWD" "$program" "$@" ;;
chromium)
  dir=$1; shift
  system "$dir"
  [ -x "$dir/usr/bin/chromium" ] || { echo "no Chromium in $dir; run: real_blender.sh install $dir" >&2; exit 1; }
  bind "$dir" /tmp
  exec chroot "$dir" /usr/bin/chromium --no-sandbox "$@" ;;
session | own | ended | looks)
  dir=$1; shift
  script=(tools/window/session.py --)
  if [ "$what" = own ]; then script=(tools/window/own_shoots.py -- "$1"); shift; fi
  if [ "$what" = ended ]; then script=(tools/window/ended_process.py --); fi
  if [ "$what" = looks ]; then script=(tools/window/looks.py --); fi
  mkdir -p "$1"; out=$(realpath "$1")
  cache=${PATINA_CACHE:-${XDG_CACHE_HOME:-$HOME/.cache}/patina}
  system "$dir"
  bind "$dir" "$here"
  bind "$dir" "$cache"
  bind "$dir" "$out"
  { [ -x "$dir/usr/bin/import" ] && [ -x "$dir/usr/bin/xdotool" ]; } || inside "$dir" apt-get \
    install -y -qq --no-install-recommends xvfb xauth imagemagick xdotool fonts-dejavu-core >/dev/null
  BLENDER_USER_RESOURCES="$cache/blender-4.3-cp313" inside "$dir" /bin/bash -c '
    cd "$0"; export LIBGL_ALWAYS_SOFTWARE=1
    exec xvfb-run --auto-servernum -s "-screen 0 1600x1000x24 +extension GLX" timeout 1800 \
      blender --factory-startup --addons bl_ext.user_default.patina --window-geometry 0 0 1600 1000 \
      -P "$@"' "$here" "${script[@]}" "$out"
  if [ "$what" = ended ]; then # the process of the last fit ends with Blender
    left=$(grep -A1 '"left"' "$out/ended.json" | grep -oE '[0-9]+')
    sleep 2 # it may still be starting
    if grep -qs '^State:[[:space:]]*[^ZX]' "/proc/$left/status"; then echo "process $left has outlived its Blender"; exit 1; fi
  fi ;;
*) sed -n '2,15p' "$0"; exit 2 ;;
esac
