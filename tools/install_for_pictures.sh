#!/usr/bin/env bash
# What tests of pictures need: software drivers (Vulkan for rerun, OSMesa for MuJoCo) and a browser for the report. Needs apt
# and root. Where they cannot be installed, those tests are skipped, and say so.
set -uo pipefail
packages=(mesa-vulkan-drivers libosmesa6 chromium)
if dpkg-query --show "${packages[@]}" >/dev/null 2>&1; then
    exit 0
fi
if [[ $(id -u) -ne 0 ]] || ! command -v apt-get >/dev/null; then
    echo "nothing for pictures (${packages[*]}): apt-get and root are needed; tests that make pictures will be skipped" >&2
    exit 0
fi
if ! { timeout 120 apt-get update -qq && timeout 300 apt-get install -qq -y --no-install-recommends "${packages[@]}"; } \
    >/dev/null 2>&1; then
    echo "packages for pictures (${packages[*]}) cannot be installed; tests that make pictures will be skipped" >&2
fi
exit 0
