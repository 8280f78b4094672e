#!/usr/bin/env bash
# What tests of pictures need: software drivers (Vulkan for rerun, OSMesa for MuJoCo) and a browser for the report. Needs apt
# and root. Where they cannot be installed, those tests are skipped; `tests/conftest.py` names the missing packages at the end.
set -uo pipefail
packages=(mesa-vulkan-drivers libosmesa6 chromium)
if dpkg-query --show "${packages[@]}" >/dev/null 2>&1; then
    exit 0
fi
if [[ $(id -u) -ne 0 ]] || ! command -v apt-get >/dev/null; then
    echo "Tests of pictures need ${packages[*]}: install them as root with apt-get. Until then these tests are skipped." >&2
    exit 0
fi

install() {
    timeout 120 apt-get update -qq &&
        timeout 600 apt-get install -qq -y --no-install-recommends -o DPkg::Lock::Timeout=120 "${packages[@]}"
}

# Another apt process may hold a lock, for whose lists apt-get knows no time limit: try for two minutes.
for _ in {1..12}; do
    if reason=$(DEBIAN_FRONTEND=noninteractive install 2>&1); then
        exit 0
    fi
    [[ $reason == *"lock"* ]] || break
    sleep 10
done
printf 'apt-get cannot install %s:\n%s\nTests of pictures are skipped.\n' "${packages[*]}" "$(tail -n 3 <<<"$reason")" >&2
exit 0
