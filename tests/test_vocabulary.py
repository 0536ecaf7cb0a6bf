"""Code and docs use the field's words: the words of the table in CONTRIBUTING.md do not occur."""

import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent

# What must not occur, and what to write instead. Prose is compared without regard to case.
IDENTIFIERS = {
    r'(\.|\bdef )(say|hear|offer|tell)\(': 'publish, subscribe, advertise_service, report_...',
    r'\.(says|hears)\b': 'publisher_qos, subscriber_qos',
    r'\bBorder\b': 'CommandGuard',
    r'\bclass Turns\b': 'StampOrderedDispatcher',
    r'\bPresence\b': 'DiscoveryRefresher',
    r'\bKeptWaitSetExecutor\b': 'CachedWaitSetExecutor',
    r'\bKeptLearner\b': 'PersistentLearner',
    r'\bgo_(before_all_else|as_any_program|back_among_all)\b': '..._realtime_scheduling',
    r'\b_?troubles\b': 'pop_errors',
    r'\b_?take_up\b': 'resume',
    r'_ELSEWHERE_TO_': '_..._NEGATIVES',
    r'\b(Life|Pupil)\b': 'TrialLoop, OnlineLearner',
    r'\b_(mind|studio|film|overhear|Witness)\b': '_attention_nodes, _render_thread, _frame_buffer',
    r"\.well\b|'well'": 'ok',
}
PROSE = {
    r'\bcoldness\b': 'inverse temperature',
    r'\bhast(y|iest|ily)\b': 'annealing rate',
    r'\bbeaten\b': 'worst member',
    r'\buntaught\b': 'from initial weights',
    r'\bmend(s|ed|ing)?\b': 'fix',
    r'\blessons?\b': 'update, training step',
    r'\b(begins?|began|begun)[ _]anew\b': 're-initialise, restart',
    r'\b(she|he) (means|meant)\b|\b(is|was|were|be) meant\b': 'the attended object, gaze target',
    r'\bwhoever\b': 'the one that, any node that',
    r'\bnobody\b': 'no node, no one',
    r'\bsomebody\b': 'a person, a node, a subscriber',
    r'\b(is|are|was|were|be|being) (told|said)\b': 'receives, is stated',
    r'\breckons?\b': 'computes, estimates',
    r'\bliv(es?|ed|ing) through\b': 'experiences, processes',
}
# Names on the wire and in files stay as they are: columns of a data set.
_KEPT = re.compile(r"\bmeant_(pan|tilt)_rad\b|'meant'|\{name\}_pan_rad")


def _pages() -> list[Path]:
    """Every file of code and prose that git knows or would add, but this one."""
    listed = subprocess.run(
        ['git', 'ls-files', '-co', '--exclude-standard'],
        cwd=ROOT, capture_output=True, text=True, check=True,
    )  # fmt: skip
    paths = (ROOT / line for line in listed.stdout.splitlines())
    kinds = ('.py', '.md', '.yaml', '.xml', '.toml', '.in', '.sh')
    return [
        path
        for path in paths
        if path.suffix in kinds
        and path.exists()
        and path.name not in (Path(__file__).name, 'CONTRIBUTING.md')
    ]


def _group(path: Path) -> str:
    parts = path.relative_to(ROOT).parts
    return parts[2] if parts[:2] == ('ros2_ws', 'src') else parts[0]


PAGES = _pages()


@pytest.mark.parametrize('group', sorted({_group(path) for path in PAGES}))
def test_words_of_our_own_do_not_occur(group: str) -> None:
    wrong = []
    for path in PAGES:
        if _group(path) != group:
            continue
        for number, line in enumerate(path.read_text(encoding='utf-8').splitlines(), 1):
            text = _KEPT.sub('', line)
            rules = [(IDENTIFIERS, 0), (PROSE, re.IGNORECASE)]
            wrong += [
                f'{path.relative_to(ROOT)}:{number}: {found[0]!r}, write: {instead}'
                for table, flags in rules
                for pattern, instead in table.items()
                if (found := re.search(pattern, text, flags))
            ]
    assert not wrong, '\n'.join(wrong)


def test_pages_were_found() -> None:
    assert len(PAGES) > 200
