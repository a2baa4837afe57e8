#!/usr/bin/env bash
# Builds the site: the pages of docs/, the examples, and a reference of all names. Open build/site/index.html;
# no server is needed. Any link that leads nowhere is an error.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

scripts/setup.sh site
rm -rf build/site build/site-source
python3 -B scripts/site/layout.py . build/site-source
sphinx-build -W --keep-going -q -j auto -b html -d build/site-source/.cache -c scripts/site build/site-source build/site
echo "the site is at build/site/index.html"
