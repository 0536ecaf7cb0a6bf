"""The whole way of `./ja meet`, without a person: a simulated one reads the page and turns."""

from dataclasses import replace

import pytest

from ja_caregiver.core.meeting import load_meeting
from ja_common.executor import CachedWaitSetExecutor
from ja_runner.graph import meet_graph
from live_person import LivePersonNode
from ros_testing import spin_until

# In lockstep, as the demo: the time is that of the pictures, however busy the machine is.
LOCKSTEP = {
    'gate': {'lockstep': True, 'max_speed_rad_s': 20.0, 'max_acceleration_rad_s2': 1000.0},
    'learning_module': {'lockstep': True},
}


def run_meeting(context, folder, trials, *, pace=2.0, things=4, timeout_s=300.0, **scorer):
    """Run a meeting until its end; return it and the person."""
    scorer = {'folder': str(folder), 'trials': trials, **scorer}
    graph = [
        replace(
            spec,
            parameters={
                **spec.parameters,
                **LOCKSTEP.get(spec.executable, {}),
                'use_sim_time': True,
            },
        )
        for spec in meet_graph(None, 3, pace, scorer)
    ]
    executor = CachedWaitSetExecutor(context=context)
    nodes = [
        spec.load()(context=context, cli_args=spec.ros_arguments(), use_global_arguments=False)
        for spec in graph
    ]
    person = LivePersonNode(things, context=context)
    nodes.append(person)
    path = folder / 'meeting.json'
    try:
        for node in nodes:
            executor.add_node(node)
        spin_until(executor, lambda: path.exists() and load_meeting(path).ended, timeout_s)
    finally:
        executor.shutdown()
        for node in reversed(nodes):
            node.destroy_node()
    return load_meeting(path), person


def check_requests(meeting, person):
    """Check that she was asked for things that are there, and that each answer is a trial."""
    assert meeting.ended == 'all requests were made'
    asked = [number for number, _ in person.asked]
    # A request that was not answered is made again, so there may be more requests than trials.
    left = iter(asked)
    assert all(trial.asked in left for trial in meeting.trials)
    for trial in meeting.trials:
        assert trial.asked in trial.things
        assert trial.proposed is not None


def test_a_short_meeting_from_the_first_picture_to_the_end(ros_context, tmp_path):
    meeting, person = run_meeting(ros_context, tmp_path, trials=3, rearrange_every=2)
    assert len(meeting.trials) == 3
    check_requests(meeting, person)
    assert all((tmp_path / trial.face_picture).is_file() for trial in meeting.trials)
    assert all((tmp_path / trial.view_picture).is_file() for trial in meeting.trials)


@pytest.mark.learning
def test_the_learner_learns_to_follow_a_person_who_does_what_the_page_asks(ros_context, tmp_path):
    """The figure of the rehearsal film, with requests that are drawn live."""
    meeting, person = run_meeting(
        ros_context, tmp_path, trials=60, things=5, rearrange_every=5, timeout_s=3600.0
    )
    check_requests(meeting, person)
    rate = meeting.learner_rate(slice(-20, None))
    assert rate.rate > 0.6 > meeting.chance(slice(-20, None)) + 0.2
