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
    -o Dir::Cache::pkgcache=pkgcache.bin -o Dir::Cache::srcpkgcache=srcpkgcache.bin \
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
  # A mirror in the middle of an update may lack the lists of one suite for a day: the release's own are enough.
  if private_apt "$1" apt-get update >"$folder/log" 2>&1 ||
    [ -n "$(find "$folder/state/lists" -name "*_debian_dists_${codename}_main_binary-$1_Packages*" -print -quit)" ]; then
    touch "$folder/updated"
  elif [ ! -e "$folder/updated" ]; then
    fail "Debian's package lists for $1 could not be fetched: $(tail -n 1 "$folder/log")" "is the network there?"
  fi
}

download() { # download ARCHITECTURE FOLDER PACKAGE[=VERSION]...: into FOLDER, which is emptied before
  local architecture=$1 folder=$2
  shift 2
  rm -rf "$folder" && mkdir -p "$folder"
  (cd "$folder" && private_apt "$architecture" apt-get download "$@" >log 2>&1) ||
    fail "$* for $architecture could not be fetched: $(tail -n 1 "$folder/log")" "is the network there?"
}

unpack() { # unpack ARCHITECTURE FOLDER PACKAGE[=VERSION]...: into FOLDER, each version of a package once
  local architecture=$1 folder=$2 package version versions missing=() names=()
  shift 2
  mkdir -p "$folder"
  # All in one question: each takes its time. What is not there is missed below.
  versions=$(private_apt "$architecture" apt-cache show --no-all-versions "$@" 2>/dev/null |
    awk '/^Package: / { name = $2 } /^Version: / { print name, $2 }' || true)
  for package in "$@"; do
    version=$(awk -v name="${package%%=*}" '$1 == name { print $2; exit }' <<<"$versions")
    [ -n "$version" ] || fail "there is no package $package for $architecture in Debian $codename" "was it renamed?"
    grep -qxF "${package%%=*} $version $architecture" "$folder/.unpacked" 2>/dev/null && continue
    missing+=("$package")
    names+=("${package%%=*} $version $architecture")
  done
  [ ${#missing[@]} -gt 0 ] || return 0
  download "$architecture" "$folder/.deb" "${missing[@]}"
  for package in "${missing[@]}"; do dpkg -x "$folder/.deb/${package%%=*}_"*.deb "$folder"; done
  printf '%s\n' "${names[@]}" >>"$folder/.unpacked"
  rm -rf "$folder/.deb"
}

kernel_package() { # kernel_package ARCHITECTURE: its ABI number changes with each security update
  private_apt "$1" apt-cache depends "linux-image-$1" | awk '/Depends: linux-image-[0-9]/ { print $2; exit }'
}

# What a module or a program needs of its own kind, without running anything of the other architecture. `unpacked` is
# where the packages are, `release` the kernel's, and `root` the guest's files, which may be there already.
depends_of() { # depends_of FILE: names of the modules that this one needs
  tr '\0' '\n' <"$1" | sed -n 's/^depends=//p' | tr ',' '\n' | grep . || true
}

with_dependencies() { # with_dependencies MODULE: the files to load, in order; what is built into the kernel has no file
  local file dependency
  file=$(find "$unpacked/lib/modules/$release" -name "${1//[-_]/[-_]}.ko" -print -quit)
  [ -n "$file" ] || return 0
  while read -r dependency; do with_dependencies "$dependency"; done < <(depends_of "$file")
  echo "$file"
}

add_libraries() { # add_libraries FOLDER FILE...: every library that the files ask for, and those ask for, into FOLDER
  local folder=$1 file library found
  shift
  for file in "$@"; do
    while read -r library; do
      [ -e "$root/lib/$library" ] || [ -e "$folder/$library" ] || [[ $library = ld-linux* ]] && continue
      found=$(find "$unpacked/lib" "$unpacked/usr/lib" -name "$library" -print -quit)
      [ -n "$found" ] || fail "no package brings the library $library" "add it to ${0#"$repository/"}"
      cp -L "$found" "$folder/$library"
      add_libraries "$folder" "$found"
    done < <(readelf -d "$file" | sed -n 's/.*(NEEDED).*\[\(.*\)\]/\1/p')
  done
}
