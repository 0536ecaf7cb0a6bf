"""docs/topics.md and docs/parameters.md agree with the code."""

from pathlib import Path

from ja_bringup.reference import write_reference
from ja_common.core.parameter_page import PAGE

DOCS = Path(__file__).parents[2] / 'docs'


def test_the_reference_pages_are_those_of_the_code(domain, tmp_path):
    for page in write_reference(tmp_path):
        assert page.read_text() == (DOCS / page.name).read_text(), 'run `./ja reference`'


def test_the_nodes_read_the_same_page_of_parameters():
    assert PAGE.read_text() == (DOCS / PAGE.name).read_text(), 'run `./ja reference`'
