"""The decisions of the set-up, without a set-up."""

import pytest

from bootstrap.plan import (
    BootstrapError,
    Python,
    Step,
    SystemPackage,
    apt_advice,
    choose_python,
    distro_of_wheels,
    fingerprint,
    parts_left_out,
    ros_is_sourced,
    steps_to_do,
)

OLD = Python('/usr/bin/python3.9', (3, 9))
P311 = Python('/usr/bin/python3.11', (3, 11))
P312 = Python('/usr/bin/python3.12', (3, 12), has_rclpy=True)
NEW = Python('/usr/bin/python3.14', (3, 14))


def test_the_first_supported_python_is_chosen():
    assert choose_python([OLD, NEW, P311, P312]) is P311


def test_with_ros_sourced_the_python_of_its_rclpy_is_chosen():
    assert choose_python([P311, P312], sourced=True) is P312
    with pytest.raises(BootstrapError, match='can import its rclpy'):
        choose_python([P311], sourced=True)


@pytest.mark.parametrize('candidates', [[], [OLD], [OLD, NEW]])
def test_without_a_supported_python_the_message_names_the_range(candidates):
    with pytest.raises(BootstrapError, match=r'Python 3\.10 to 3\.13 is needed.*JA_PYTHON'):
        choose_python(candidates)


def test_a_wrong_ja_python_is_named():
    with pytest.raises(BootstrapError, match=r'JA_PYTHON=python3\.9 is of another version'):
        choose_python([OLD], wanted='python3.9')
    with pytest.raises(BootstrapError, match='JA_PYTHON=nonsense is not a Python'):
        choose_python([], wanted='nonsense')


def test_only_distributions_that_the_graph_runs_on_may_be_sourced():
    assert not ros_is_sourced({})
    for distro in ('jazzy', 'kilted'):
        assert ros_is_sourced({'ROS_DISTRO': distro})
        assert ros_is_sourced({'ROS_DISTRO': distro, 'JA_ROS_DISTRO': distro})
    with pytest.raises(BootstrapError, match=r'ROS 2 humble is sourced .* jazzy or kilted: open'):
        ros_is_sourced({'ROS_DISTRO': 'humble'})


def test_what_is_sourced_must_be_what_is_wanted():
    with pytest.raises(BootstrapError, match='kilted is sourced here, but JA_ROS_DISTRO is jazzy'):
        ros_is_sourced({'ROS_DISTRO': 'kilted', 'JA_ROS_DISTRO': 'jazzy'})


def test_the_wheels_are_those_wanted_or_installed_or_of_jazzy():
    assert distro_of_wheels(None) == 'jazzy'
    assert distro_of_wheels('', 'kilted') == 'kilted'
    assert distro_of_wheels('jazzy', 'kilted') == 'jazzy'
    with pytest.raises(BootstrapError, match='JA_ROS_DISTRO=humble: this system runs on jazzy or'):
        distro_of_wheels('humble')


STEPS = [Step('environment', 'e1'), Step('base.lock', 'b1'), Step('packages', 'p1')]


def test_a_fresh_checkout_needs_every_step_and_a_ready_one_none():
    assert steps_to_do(STEPS, {}) == STEPS
    assert steps_to_do(STEPS, {step.name: step.fingerprint for step in STEPS}) == []


def test_an_interrupted_setup_goes_on_where_it_stopped():
    assert steps_to_do(STEPS, {'environment': 'e1'}) == STEPS[1:]


def test_only_what_changed_is_done_again():
    stamp = {'environment': 'e1', 'base.lock': 'b1', 'packages': 'p0'}
    assert steps_to_do(STEPS, stamp) == [STEPS[2]]


def test_a_new_environment_has_to_be_filled_again():
    stamp = {'environment': 'e0', 'base.lock': 'b1', 'packages': 'p1'}
    assert steps_to_do(STEPS, stamp) == STEPS


def test_the_fingerprint_separates_its_parts():
    assert fingerprint('ab', 'c') != fingerprint('a', 'bc')
    assert fingerprint('ab', b'c') == fingerprint('ab', 'c')


def test_apt_advice_gives_the_exact_command_to_those_who_lack_the_right():
    both = [SystemPackage(name, 'to render') for name in ('libegl1', 'libgl1-mesa-dri')]
    assert apt_advice(both, is_root=True, has_apt=True) is None
    command = 'sudo apt-get update && sudo apt-get install -y libegl1 libgl1-mesa-dri'
    advice = apt_advice(both, is_root=False, has_apt=True)
    assert command in advice
    assert 'libegl1, libgl1-mesa-dri (to render)' in advice
    assert 'package manager' in apt_advice(both, is_root=True, has_apt=False)


def test_without_the_sim_there_are_no_experiments():
    assert parts_left_out('') == ()
    assert parts_left_out('dashboard') == ('dashboard',)
    assert parts_left_out('sim,dashboard') == ('dashboard', 'experiments', 'sim')


def test_an_unknown_part_is_named():
    with pytest.raises(BootstrapError, match=r'JA_WITHOUT=sim gate: no part is called gate'):
        parts_left_out('sim gate')
