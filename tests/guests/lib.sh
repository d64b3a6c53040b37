# Debian packages for another machine or another architecture, fetched without touching this machine's packages.
# Sourced by `prepare`, `cross` and `video-i2c`. Everything lives below target/guests, and is used again.
# shellcheck shell=bash
set -euo pipefail

repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
guests=${GRIDEYE_GUESTS:-$repository/target/guests}
keyring=/usr/share/keyrings/debian-archive-keyring.gpg
# The release of this machine, so that programs built here find their C library in the guest; bookworm elsewhere.
codename=$(. /etc/os-release && [ "${ID:-}" = debian ] && echo "${VERSION_CODENAME:-}" || true)
codename=${codename:-bookworm}

fail() { # fail WHAT HINT
  printf 'error: %s\nhint: %s\n' "$1" "$2" >&2
  exit 1
}

need() { # need PACKAGE PROGRAM...: each program, or the package that brings it
  local package=$1 program
  shift
  for program in "$@"; do
    PATH=$PATH:/usr/sbin:/sbin command -v "$program" >/dev/null || fail "$program is missing" "apt-get install $package"
  done
}

private_apt() { # private_apt ARCHITECTURE PROGRAM ARGUMENTS...: apt-get or apt-cache for that architecture
  local architecture=$1 program=$2 folder=$guests/apt/$1-$codename
  shift 2
  "$program" -q -o Dir::State="$folder/state" -o Dir::State::status="$folder/status" -o Dir::Cache="$folder/cache" \
    -o Dir::Etc::SourceList="$folder/sources.list" -o Dir::Etc::SourceParts=/dev/null \
    -o APT::Architecture="$architecture" -o APT::Architectures::="$architecture" \
    -o APT::Sandbox::User="$(id -un)" -o Acquire::Languages=none "$@"
}

update_lists() { # update_lists ARCHITECTURE: at most once a day, because the kernel's name changes with each security update
  local folder=$guests/apt/$1-$codename
  [ -n "$(find "$folder/updated" -mmin -1440 2>/dev/null)" ] && return 0
  need debian-archive-keyring apt-get dpkg
  mkdir -p "$folder/state/lists/partial" "$folder/cache/archives/partial"
  : >"$folder/status"
  local suite
  for suite in "debian $codename" "debian $codename-updates" "debian-security $codename-security"; do
    echo "deb [arch=$1 signed-by=$keyring] http://deb.debian.org/$suite main"
  done >"$folder/sources.list"
  if private_apt "$1" apt-get update >"$folder/log" 2>&1; then
    touch "$folder/updated"
  elif [ ! -e "$folder/updated" ]; then
    fail "Debian's package lists for $1 could not be fetched: $(tail -n 1 "$folder/log")" "is the network there?"
  fi
}

unpack() { # unpack ARCHITECTURE FOLDER PACKAGE[=VERSION]...: into FOLDER, each version of a package once
  local architecture=$1 folder=$2 package version name
  shift 2
  mkdir -p "$folder"
  for package in "$@"; do
    version=$(private_apt "$architecture" apt-cache show --no-all-versions "$package" | sed -n 's/^Version: //p' | head -n 1)
    [ -n "$version" ] || fail "there is no package $package for $architecture in Debian $codename" "was it renamed?"
    name="${package%%=*} $version $architecture"
    grep -qxF "$name" "$folder/.unpacked" 2>/dev/null && continue
    rm -rf "$folder/.deb" && mkdir "$folder/.deb"
    (cd "$folder/.deb" && private_apt "$architecture" apt-get download "$package" >log 2>&1) ||
      fail "$package for $architecture could not be fetched: $(tail -n 1 "$folder/.deb/log")" "is the network there?"
    dpkg -x "$folder/.deb/"*.deb "$folder"
    echo "$name" >>"$folder/.unpacked"
    rm -rf "$folder/.deb"
  done
}
