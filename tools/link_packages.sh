#!/usr/bin/env bash
# Writes build/import/carrierflex: links to the packages below the name they are imported by.
# mypy and pytest read it; with it on PYTHONPATH a checkout runs without an installation.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
target=build/import/carrierflex
mkdir -p "$target"
find "$target" -xtype l -delete
for init in */__init__.py; do
    package=${init%/*}
    [ "$package" = carrierflex ] || ln -sfn "../../../$package" "$target/$package"
done
for file in carrierflex/*.py; do
    ln -sfn "../../../$file" "$target/${file#carrierflex/}"
done
