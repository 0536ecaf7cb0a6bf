"""docs/topics.md and docs/parameters.md agree with the code."""

from pathlib import Path

from ja_bringup.reference import write_reference

DOCS = Path(__file__).parents[2] / 'docs'


def test_the_reference_pages_are_those_of_the_code(domain, tmp_path):
    for page in write_reference(tmp_path):
        assert page.read_text() == (DOCS / page.name).read_text(), 'run `./ja reference`'
