#!/usr/bin/env bash
# The documentation site, warnings being errors: results/site/index.html, which opens without a network.
# The pages' examples are run by `scripts/run_pages.py` and by the tests.
source "$(dirname "${BASH_SOURCE[0]}")/setup.sh"

bin="$venv/bin"
"$bin/python" -c 'import ipykernel, jupytext, material, mkdocstrings, nbclient' 2>/dev/null ||
    "$bin/python" -m pip install -qq --disable-pip-version-check --editable '.[docs]' ||
    fail "the extra docs could not be installed"
"$bin/python" scripts/reference_pages.py --check ||
    fail "docs/reference is stale: python scripts/reference_pages.py writes it anew"
NO_MKDOCS_2_WARNING=1 "$bin/mkdocs" build --quiet --strict
echo "wrote results/site/index.html: $(find results/site -name '*.html' | wc -l) pages"
