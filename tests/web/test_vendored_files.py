"""Test of the third-party files of the web page: they are unchanged, and their README names their sums."""

import hashlib
import re

from tests.source_tree import ROOT

FOLDER = ROOT / "web/static/vendor"
#: A line of sha256sum.
SUM = re.compile(r"^([0-9a-f]{64})  (\S+)$", re.MULTILINE)


def test_the_third_party_files_have_the_sums_of_their_readme():
    listed = {name: digest for digest, name in SUM.findall((FOLDER / "README.md").read_text())}
    found = {
        path.name: hashlib.sha256(path.read_bytes()).hexdigest()
        for path in FOLDER.iterdir()
        if path.name != "README.md"
    }
    assert found == listed
    assert {"LICENSE", "uPlot.esm.js", "uPlot.min.css"} == found.keys()
