#!/bin/sh
# Makes three.min.js from the published package: needs npm, and the network once.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
npm install --silent --no-audit --no-fund three@0.187.0 esbuild@0.25.12
cp "$here/three.entry.js" entry.js
{
    echo "/*! three.js r187, MIT licence, see three.LICENSE; made by make-three.sh */"
    npx esbuild entry.js --bundle --minify --format=iife --global-name=THREE --target=es2020 --legal-comments=none
} > "$here/three.min.js"
cp node_modules/three/LICENSE "$here/three.LICENSE"
