"""A node's health: silence, problems that fade, news only."""

from ja_common.core.health import Health, Level


def test_healthy_node_reports_ok_and_counts_of_messages():
    health = Health(now_s=100.0)
    health.watch_input('/image', every_s=1.0)
    for i in range(20):
        health.record_message('/image', 100.0 + i / 10)
    health.values['trials'] = '7'
    report = health.report(102.0)
    assert (report.level, report.message) == (Level.OK, 'OK')
    assert report.values == {
        '/image received': '20', '/image rate [1/s]': '10.0', 'trials': '7',
    }  # fmt: skip
    assert health.report(104.0).values['/image rate [1/s]'] == '0.0', 'since the last report'


def test_silence_is_noticed_after_the_last_message_and_later_before_the_first():
    health = Health(now_s=0.0)
    health.watch_input('/image', every_s=1.0)
    health.watch_input('/sometimes', every_s=None)
    assert health.silent_inputs(2.9) == {}, 'others may still be starting'
    assert health.silent_inputs(3.1) == {'/image': 3.0}
    health.record_message('/image', 3.2)
    assert health.silent_inputs(4.1) == {}
    assert health.silent_inputs(4.3) == {'/image': 1.0}


def test_problem_is_news_once_until_it_comes_back():
    health = Health(now_s=0.0, error_memory_s=5.0)
    assert health.record_problem('/image', 'no data', 1.0)
    assert not health.record_problem('/image', 'no data', 2.0)
    assert health.record_problem('/joints', 'no data', 2.0), 'another place'
    assert health.record_problem('/image', 'no data', 7.1), 'after a quiet time it is news again'


def test_a_place_with_another_message_each_time_has_news_once_a_minute():
    health = Health(now_s=0.0, error_memory_s=5.0)
    times = [i / 10 for i in range(1300)]
    news = [t for t in times if health.record_problem('/joints', f'angle {t} is not finite', t)]
    assert news == [0.0, 60.0, 120.0]
    assert health.report(130.0).message == 'angle 129.9 is not finite', 'the newest is shown'


def test_a_problem_that_becomes_worse_is_news():
    health = Health(now_s=0.0)
    assert health.record_problem('hold', 'images are late', 1.0, Level.WARN)
    assert health.record_problem('hold', 'another commander', 1.1, Level.ERROR)
    assert not health.record_problem('hold', 'images are late', 1.2, Level.WARN)
    assert not health.record_problem('hold', 'another commander', 1.3, Level.ERROR)


def test_a_quiet_problem_is_shown_and_becomes_news_when_it_is_quiet_no_more():
    health = Health(now_s=0.0)
    assert not health.record_problem('silence', 'no node publishes it', 7.0, quiet=True)
    assert health.report(7.0).message == 'no node publishes it'
    assert health.record_problem('silence', 'no node publishes it', 8.0)


def test_an_input_without_a_first_message_is_starting_for_a_while():
    health = Health(now_s=0.0)
    health.watch_input('/image', every_s=1.0)
    health.watch_input('/joints', every_s=1.0)
    health.record_message('/joints', 1.0)
    assert health.is_starting('/image', 20.0)
    assert not health.is_starting('/image', 31.0)
    assert not health.is_starting('/joints', 20.0)


def test_report_has_the_worst_level_and_every_message_until_they_fade():
    health = Health(now_s=0.0, error_memory_s=5.0)
    health.record_problem('a', 'slow', 1.0, Level.WARN)
    health.record_problem('b', 'broken', 3.0, Level.ERROR)
    report = health.report(4.0)
    assert (report.level, report.message) == (Level.ERROR, 'slow; broken')
    assert health.report(7.0).message == 'broken'
    assert health.report(9.0).level is Level.OK


def test_cleared_problem_is_gone_at_once():
    health = Health(now_s=0.0)
    health.record_problem('a', 'slow', 1.0)
    health.clear_problem('a')
    health.clear_problem('never occurred')
    assert health.report(1.0).level is Level.OK
