#!/usr/bin/env bash
# Makes sure that there is a Rust toolchain and a Vulkan driver; a software driver serves.
set -euo pipefail

if ! command -v cargo >/dev/null; then
    echo "cargo is missing: install Rust from https://rustup.rs or your distribution, then run this again" >&2
    exit 1
fi
if ! command -v cc >/dev/null; then
    echo "a C linker is missing: apt-get install gcc libc6-dev" >&2
    exit 1
fi

drivers() { compgen -G '/usr/share/vulkan/icd.d/*.json' || compgen -G '/etc/vulkan/icd.d/*.json'; }
loader() { ldconfig -p 2>/dev/null | grep -q 'libvulkan\.so\.1'; }
if [ -n "${VK_DRIVER_FILES:-}${VK_ICD_FILENAMES:-}" ] || { drivers >/dev/null && loader; }; then
    exit 0
fi
packages="mesa-vulkan-drivers libvulkan1"
as_root=""
if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null && sudo -n true 2>/dev/null && as_root="sudo -n"
fi
if command -v apt-get >/dev/null && { [ "$(id -u)" -eq 0 ] || [ -n "$as_root" ]; }; then
    echo "no Vulkan driver: installing $packages"
    $as_root apt-get update -qq
    DEBIAN_FRONTEND=noninteractive $as_root apt-get install -y -qq --no-install-recommends $packages >/dev/null
else
    echo "no Vulkan driver and no right to install one: pictures will be left out." >&2
    echo "Ask for: apt-get install $packages" >&2
fi
