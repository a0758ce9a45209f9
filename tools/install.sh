#!/usr/bin/env bash
# Installs into .venv what carrierflex needs, and says nothing when all of it is there already.
#
#   tools/install.sh [PYTHON]     PYTHON: interpreter to build .venv with; default: the last one chosen, or python3
#   tools/install.sh --development    into the .venv that stands: what only tests and benchmarks need, the tools
#                                     (requirements-dev.lock) and what has a licence of its own (requirements-extras.lock:
#                                     Intel's MKL and Exudyn)
#
# .venv/installed is written last. It holds the key of the locked packages, the key of the project, the
# interpreter, and the RECORD file of every installed package; without it .venv is built afresh.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
unset PYTHONPATH PYTHONHOME

stamp=.venv/installed
development_stamp=.venv/installed-development
venv_python=.venv/bin/python
uv_folder=build/uv

# Shared library : Debian package. gmsh needs all but the last, off-screen VTK the last.
libraries=(
    libGLU.so.1:libglu1-mesa
    libGL.so.1:libgl1
    libXrender.so.1:libxrender1
    libXcursor.so.1:libxcursor1
    libXft.so.2:libxft2
    libXinerama.so.1:libxinerama1
    libgomp.so.1:libgomp1
    libEGL.so.1:libegl1
)

# Program : Debian package. Tests call them and skip where they are absent; with CI=true they are installed and
# a test that skips fails (tests/conftest.py).
programs=()
if [ "${CI:-}" = true ]; then
    programs=(chromium:chromium ccx:calculix-ccx cc:gcc cc:libc6-dev)
fi

say() { echo "install: $*"; }
fail() { echo "install: error: $*" >&2; exit 1; }

stamp_line() { sed -n "$1p" "$stamp" 2>/dev/null || true; }
key() { sha256sum | cut -d ' ' -f 1; }

# Version and path, "3.12 /usr/bin/python3.12": of the interpreter behind it if .venv itself is active, as .venv may go.
describe_python() {
    "$1" -c 'import ctypes, ssl, sys; print("%d.%d %s" % (sys.version_info[:2] + (getattr(sys, "_base_executable", sys.executable),)))' 2>/dev/null \
        || fail "no working Python (with ctypes and ssl) at '$1'; install python3, or choose another: make test PYTHON=python3.12"
}

# What the operating system still has to provide, one "name:package" a line.
missing_from_system() {
    "$python" - "${libraries[@]}" <<'PYTHON'
import ctypes
import importlib.util
import sys

for entry in sys.argv[1:]:
    try:
        ctypes.CDLL(entry.split(":")[0])
    except OSError:
        print(entry)
# Debian keeps the pip of a new environment in a package of its own.
if importlib.util.find_spec("ensurepip") is None:
    print("ensurepip:python%d.%d-venv" % sys.version_info[:2])
PYTHON
    local entry
    for entry in ${programs[@]+"${programs[@]}"}; do
        command -v "${entry%%:*}" >/dev/null || echo "$entry"
    done
    # Debian's pip trusts the certificates of this file only.
    if command -v apt-get >/dev/null && [ ! -s /etc/ssl/certs/ca-certificates.crt ]; then
        echo certificates:ca-certificates
    fi
}

install_system_packages() {
    local names=("${@%%:*}") packages=("${@#*:}") as_root=() log status=0
    local command=(apt-get install -y --no-install-recommends "${packages[@]}")
    command -v apt-get >/dev/null \
        || fail "missing on this system: ${names[*]}; install them with its package manager (in Debian: ${packages[*]})"
    if [ "$(id -u)" -ne 0 ]; then
        sudo -n true 2>/dev/null || fail "system packages are missing; run: sudo apt-get update && sudo ${command[*]}"
        as_root=(sudo -n)
    fi
    say "system packages ${packages[*]}"
    log=$(mktemp)
    # An update that fails (one of many sources unreachable) is no reason to stop: the install decides.
    "${as_root[@]}" apt-get update >"$log" 2>&1 || true
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive "${command[@]}" -o DPkg::Lock::Timeout=300 >>"$log" 2>&1 || status=$?
    [ "$status" -eq 0 ] || tail -n 5 "$log" >&2
    rm -f "$log"
    [ "$status" -eq 0 ] || fail "apt-get gave up (see above); repair it, then run as root: ${command[*]}"
}

# True when every file of every package that the finished installation recorded is still there.
environment_is_whole() {
    "$venv_python" - "$stamp" 2>/dev/null <<'PYTHON'
import csv
import pathlib
import sys

for record in pathlib.Path(sys.argv[1]).read_text().splitlines()[3:]:
    site = pathlib.Path(record).parent.parent
    with open(record, newline="") as rows:
        names = [row[0] for row in csv.reader(rows)]
    if not all((site / name).exists() for name in names if not name.endswith(".pyc")):
        sys.exit(1)
PYTHON
}

# True where uv is in build/uv, or pip could put it there; it exists for common machines only.
uv_is_there() {
    local uv_key
    uv_key=$(key <requirements-uv.lock)
    [ "$(cat "$uv_folder/installed" 2>/dev/null || true)" != "$uv_key" ] || return 0
    rm -rf "$uv_folder"
    "$venv_python" -m pip install -q --disable-pip-version-check --only-binary :all: --no-deps --require-hashes \
        --target "$uv_folder" -r requirements-uv.lock >/dev/null 2>&1 || return 1
    echo "$uv_key" >"$uv_folder/installed"
}

# Wheels of lock files into .venv, those with the hashes of the files and no others. uv first: it downloads and unpacks at
# once and shows how far it is; pip where there is no uv, or where uv cannot reach what pip is told to use by its own
# configuration. Both keep whole downloads, so that a second start goes on with what is missing.
install_wheels() {
    local files=()
    for file in "$@"; do files+=(-r "$file"); done
    if uv_is_there && UV_SYSTEM_CERTS=true "$uv_folder/bin/uv" pip install --python "$venv_python" --only-binary :all: --no-deps \
        --require-hashes "${files[@]}"; then
        return 0
    fi
    say "without uv, by pip: minutes"
    "$venv_python" -m pip install -q --disable-pip-version-check --only-binary :all: --no-deps --require-hashes "${files[@]}"
}

install_locked_packages() {
    say "locked packages into .venv with Python $version (450 MB to download, 1.5 GB on disk)"
    rm -rf .venv
    "$python" -m venv .venv || fail "'$python -m venv .venv' failed (see above)"
    install_wheels requirements.lock || fail "requirements.lock could not be installed (see above); run make again, it goes on from here"
}

# Without dependencies: what they need beside one another is in requirements.lock.
install_development_packages() {
    local development_key
    development_key=$(cat requirements-dev.lock requirements-extras.lock "$stamp" | key)
    [ "$(cat "$development_stamp" 2>/dev/null || true)" != "$development_key" ] || return 0
    say "test tools, MKL and Exudyn into .venv (about 400 MB to download; licences: docs/commands.md)"
    rm -f "$development_stamp"
    install_wheels requirements-dev.lock requirements-extras.lock || fail "the test tools could not be installed (see above)"
    echo "$development_key" >"$development_stamp"
}

install_project() {
    say "carrierflex into .venv"
    "$venv_python" -m pip install -q --disable-pip-version-check --no-deps --no-build-isolation -e . \
        || fail "pip could not install the project (see above)"
}

# Two makes at once take turns. Opened for appending because locks on network drives ask for it; nothing is written.
exec 9>>requirements.lock
flock -n 9 || { say "waiting for another installation to finish"; flock 9; }

if [ "${1:-}" = --development ]; then
    install_development_packages
    exit 0
fi

python=${1:-$(stamp_line 3)}
[ -n "${1:-}" ] || command -v "${python:-none}" >/dev/null || python=python3
python=$(describe_python "$python")
version=${python%% *}
python=${python#* }
case $version in
    3.11 | 3.12 | 3.13) ;;
    *) fail "$python is Python $version, needed is 3.11, 3.12 or 3.13; choose one: make test PYTHON=python3.12" ;;
esac

missing=$(missing_from_system)
if [ -n "$missing" ]; then
    mapfile -t entries <<<"$missing"
    install_system_packages "${entries[@]}"
    missing=$(missing_from_system)
    [ -z "$missing" ] || fail "still missing after the installation of system packages: ${missing//$'\n'/ }"
fi

packages_key=$({ echo "$version"; pwd -P; cat requirements.lock; } | key)
project_key=$(cat pyproject.toml tools/install.sh | key)
packages_stand=false
if [ "$(stamp_line 1)" = "$packages_key" ] && environment_is_whole; then
    packages_stand=true
fi
if $packages_stand && [ "$(stamp_line 2)" = "$project_key" ]; then
    exit 0
fi

rm -f "$stamp"
$packages_stand || install_locked_packages
install_project
{
    echo "$packages_key"
    echo "$project_key"
    echo "$python"
    ls -d .venv/lib/python*/site-packages/*.dist-info/RECORD
} >"$stamp.part"
mv "$stamp.part" "$stamp"
