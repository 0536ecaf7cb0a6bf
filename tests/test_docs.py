"""The pages link to what is there: files, and headings within them."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PAGES = [ROOT / 'README.md', *sorted((ROOT / 'docs').rglob('*.md'))]
_LINK = re.compile(r'\]\((?!https?:)(?P<path>[^)#\s]*)(?:#(?P<heading>[^)\s]+))?\)')


def anchors(page: Path) -> set[str]:
    """The headings of a page, as they are linked to."""
    found = re.findall(r'^#+ (.+)$', page.read_text(), re.MULTILINE)
    return {re.sub(r'[^\w\- ]', '', title.lower()).replace(' ', '-') for title in found}


@pytest.mark.parametrize('page', PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page: Path) -> None:
    for link in _LINK.finditer(page.read_text()):
        target = page.parent / link['path'] if link['path'] else page
        assert target.exists(), link[0]
        if link['heading']:
            assert link['heading'] in anchors(target), link[0]


def test_links_were_found() -> None:
    assert sum(len(_LINK.findall(page.read_text())) for page in PAGES) > 30
