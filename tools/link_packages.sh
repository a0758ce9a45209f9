#!/usr/bin/env bash
# Writes build/import/carrierflex: links to the packages below the name they are imported by.
# mypy and pytest read it; with it on PYTHONPATH a checkout runs without an installation.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
target=build/import/carrierflex
mkdir -p "$target"
find "$target" -xtype l -delete
# The packages are those that pyproject.toml maps to folders.
for package in $(sed -n 's/^"carrierflex\.\([a-z_]*\)" = "\1"$/\1/p' pyproject.toml); do
    ln -sfn "../../../$package" "$target/$package"
done
for file in carrierflex/*.py; do
    ln -sfn "../../../$file" "$target/${file#carrierflex/}"
done
