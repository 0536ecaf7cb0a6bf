"""Disturbances change the messages as they should, and a bad outcome is not ok."""

import dataclasses
import http.server
import threading
from pathlib import Path

import pytest

from ja_common.core.live_page import LIVE_PAGE
from ja_diagnostics.faults.disturbance import Disturbance
from ja_diagnostics.faults.page_attack import PageAttack
from ja_diagnostics.faults.relay import Relay
from ja_diagnostics.faults.run import COLUMNS, FaultOutcome, FaultRun


def through(disturbance, messages, times_s, until_s=10.0):
    """Return what goes out at which time [s], polled every 10 ms."""
    out = []
    for tick in range(round(until_s / 0.01)):
        now_s = tick * 0.01
        for message, put_s in zip(messages, times_s, strict=True):
            if put_s == pytest.approx(now_s):
                disturbance.queue_message(message, now_s)
        out += [(message, now_s) for message in disturbance.pop_due(now_s)]
    return out


def test_undisturbed_messages_go_out_as_they_come():
    assert through(Disturbance(), 'abc', [0.1, 0.2, 0.2]) == [('a', 0.1), ('b', 0.2), ('c', 0.2)]


def test_silence():
    assert through(Disturbance(silent=True), 'abc', [0.1, 0.2, 0.3]) == []


def test_delay_keeps_the_order():
    out = through(Disturbance(delay_s=0.5), 'abc', [0.1, 0.2, 0.2])
    assert [message for message, _ in out] == ['a', 'b', 'c']
    assert [now_s for _, now_s in out] == pytest.approx([0.6, 0.7, 0.7], abs=0.011)


def test_disorder_loses_nothing_but_one_under_way():
    out = through(Disturbance(swapped=True), 'abcde', [0.1, 0.2, 0.3, 0.4, 0.5])
    assert [message for message, _ in out] == ['b', 'a', 'd', 'c']


GOOD = FaultOutcome('camera stopped', True, 0.15, 0.3, (0, 0))


def test_outcome_that_is_ok():
    assert GOOD.ok
    assert GOOD.row() == ('camera stopped', '0.15', '-', '0.3', '0', '0', 'ok')
    assert len(GOOD.row()) == len(COLUMNS)


@pytest.mark.parametrize(
    'change',
    [
        {'stopped_s': 0.25},
        {'stops': False, 'stopped_s': 0.6},
        {'resumed_s': None},
        {'lost': (1, 0)},
        {'lost': (0, 2)},
        {'withstood': False},
    ],
)
def test_outcome_that_is_not_ok(change):
    assert not dataclasses.replace(GOOD, **change).ok


@pytest.mark.slow
@pytest.mark.usefixtures('domain')
def test_head_stops_and_goes_on_through_every_fault(tmp_path: Path):
    out: list[str] = []
    run = FaultRun(tmp_path, out.append)
    assert run.run(run.faults()) == 0
    assert len(run.outcomes) == len(run.faults())
    assert [outcome for outcome in run.outcomes if not outcome.ok] == []


class Admitting(http.server.BaseHTTPRequestHandler):
    """A page that answers to every name and every site."""

    def do_GET(self) -> None:
        self.send_response(200)
        self.send_header('Content-Length', '0')
        self.end_headers()

    def log_message(self, *_: object) -> None:
        pass


def test_a_page_that_admits_another_site_is_not_ok(make_bench, tmp_path: Path):
    relay = make_bench(Relay).node
    with http.server.ThreadingHTTPServer(('127.0.0.1', 0), Admitting) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        log = tmp_path / 'view.log'
        log.write_text(f'{LIVE_PAGE}http://127.0.0.1:{server.server_port}\n')
        attack = PageAttack(log)
        attack.begin(relay)
        assert len(attack.not_refused) == 3
        assert not attack.is_withstood()
        server.shutdown()


def test_a_page_that_is_not_there_is_not_ok(make_bench, tmp_path: Path):
    attack = PageAttack(tmp_path / 'view.log')
    attack.begin(make_bench(Relay).node)
    assert not attack.is_withstood()
