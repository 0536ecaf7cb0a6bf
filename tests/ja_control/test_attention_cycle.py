"""The attention cycle, trial after trial, in a world of angles only."""

from collections import deque
from dataclasses import replace

import numpy as np
import pytest

from ja_common.core.posture import Posture
from ja_control.core.attention_cycle import (
    AttentionCycle,
    AttentionCycleConfig,
    CycleInput,
    Phase,
    Source,
)
from ja_control.core.gating import Gating, GatingConfig

PERIOD_S = 0.1
VIEW = np.radians([18.0, 13.5])
D_TH = np.radians(6.0)
CONFIG = AttentionCycleConfig()


class AngleWorld:
    """A head of limited speed (and dead time), the caregiver's face, and objects, as directions.

    `learner` is what the learning module proposes at a posture. The most salient object comes
    first.
    """

    def __init__(self, objects=(), face=(0.0, 0.0), dead_images=0, speed=2.0):
        self.objects = [np.array(o) for o in objects]
        self.face = None if face is None else np.array(face)
        self.learner = lambda posture: None
        self.stamp_ns = 10**9
        self.position, self.velocity = np.zeros(2), np.zeros(2)
        self._speed = speed
        self._orders = deque([np.zeros(2)] * dead_images)

    def percept(self):
        still = not self.velocity.any()
        in_view = [o - self.position for o in self.objects if self._sees(o)]
        centred = [d for d in in_view if np.hypot(*d) < D_TH]
        return CycleInput(
            Posture(self.stamp_ns, self.position.copy(), self.velocity.copy()),
            face_delta=self.face - self.position if self._sees(self.face) else None,
            vf_delta=in_view[0] if in_view else None,
            lm_delta=self.learner(self.position),
            fixation=self.position + centred[0] if centred and still else None,
        )

    def follow(self, target):
        """Follow a target for the time of one image."""
        self._orders.append(np.array(target))
        reach = self._speed * PERIOD_S
        way = np.clip(self._orders.popleft() - self.position, -reach, reach)
        self.position = self.position + way
        self.velocity = way / PERIOD_S
        self.stamp_ns += round(PERIOD_S * 1e9)

    def _sees(self, direction):
        return direction is not None and bool(np.all(np.abs(direction - self.position) < VIEW))


def make_cycle(p_lm=0.0, seed=0, **config):
    gating = Gating(GatingConfig(gating='constant', p_lm_max=p_lm))
    return AttentionCycle(replace(CONFIG, **config), gating, np.random.default_rng(seed))


def run(cycle, world, images):
    """Let the cycle drive the world; return [(percept, decision)] of every image."""
    rounds = []
    for _ in range(images):
        percept = world.percept()
        decision = cycle.step(percept)
        world.follow(decision.target)
        rounds.append((percept, decision))
    return rounds


def phases(rounds):
    """Return the phases in their order, each run of equal ones once."""
    found = [decision.phase for _, decision in rounds]
    return [p for i, p in enumerate(found) if i == 0 or p is not found[i - 1]]


def first(rounds, phase):
    return next(i for i, (_, decision) in enumerate(rounds) if decision.phase is phase)


def test_visual_feedback_fixates_the_salient_object_and_the_head_looks_back():
    world = AngleWorld(objects=[(0.25, 0.1), (-0.2, 0.0)])
    cycle = make_cycle()
    rounds = run(cycle, world, 40)
    assert phases(rounds)[:3] == [Phase.LOOK, Phase.SHIFT, Phase.LOOK]
    shift = first(rounds, Phase.SHIFT)
    decision = rounds[shift][1]
    assert decision.source is Source.VISUAL_FEEDBACK
    assert decision.target == pytest.approx((0.25, 0.1))
    done = next(i for i, (_, d) in enumerate(rounds) if d.trials == 1)
    assert rounds[done][0].fixation == pytest.approx((0.25, 0.1))
    assert rounds[done][1].target == pytest.approx((0.0, 0.0)), 'back to where the face was'
    assert cycle.trials >= 2, 'and then again'


def test_head_dwells_on_the_centred_face_before_the_first_shift():
    world = AngleWorld(objects=[(0.25, 0.0)], face=(0.1, 0.05))
    rounds = run(make_cycle(dwell_s=0.5), world, 20)
    shift = first(rounds, Phase.SHIFT)
    centred = next(
        i for i, (p, _) in enumerate(rounds)
        if np.hypot(*p.face_delta) < CONFIG.look_tolerance_rad and not p.posture.velocity.any()
    )  # fmt: skip
    assert shift - centred == round(0.5 / PERIOD_S)
    assert all(d.source is Source.FACE for _, d in rounds[:shift])


def test_learning_module_leads_beyond_the_first_view():
    unseen = np.array([0.6, 0.1])
    world = AngleWorld(objects=[(-0.2, 0.0), unseen])
    world.learner = lambda posture: unseen - posture
    rounds = run(make_cycle(p_lm=1.0), world, 20)
    shift = rounds[first(rounds, Phase.SHIFT)][1]
    assert shift.source is Source.LEARNING_MODULE
    assert shift.target == pytest.approx(unseen)
    done = next(i for i, (_, d) in enumerate(rounds) if d.trials == 1)
    assert rounds[done][0].fixation == pytest.approx(unseen)


def test_visual_feedback_stands_in_while_the_learner_has_no_answer():
    world = AngleWorld(objects=[(0.25, 0.0)])
    rounds = run(make_cycle(p_lm=1.0), world, 10)
    assert rounds[first(rounds, Phase.SHIFT)][1].source is Source.VISUAL_FEEDBACK


def shifts_by_learner(**config):
    """Return whether the LM led each shift of trials without fixation, (trials, 5)."""
    world = AngleWorld(objects=[])
    world.learner = lambda posture: np.zeros(2)
    cycle = make_cycle(p_lm=0.3, max_shifts=5, dwell_s=0.0, **config)
    draws, seen = [], None
    for _, decision in run(cycle, world, 4000):
        now = (decision.trials, decision.shifts)
        if decision.phase is Phase.SHIFT and now != seen:
            draws.append(decision.source is Source.LEARNING_MODULE)
            seen = now
    return np.reshape(draws[: len(draws) // 5 * 5], (-1, 5))


def test_source_is_drawn_at_every_shift_at_the_rate_of_the_gate():
    led = shifts_by_learner()
    assert led.size > 2000
    assert led.mean() == pytest.approx(0.3, abs=4 * np.sqrt(0.21 / led.size))
    assert set(led.sum(axis=1)) > {1, 2, 3}, 'not once a trial'


def test_source_may_be_drawn_once_a_trial():
    led = shifts_by_learner(source_drawn='first_shift')
    assert led.mean() == pytest.approx(0.3, abs=4 * np.sqrt(0.21 / len(led)))
    assert set(led.sum(axis=1)) == {0, 5}


def test_same_seed_draws_the_same_sources():
    def sources(seed):
        world = AngleWorld(objects=[(0.25, 0.0)])
        world.learner = lambda posture: np.array([-0.1, 0.0])
        rounds = run(make_cycle(p_lm=0.5, seed=seed), world, 200)
        return [decision.source for _, decision in rounds]

    assert sources(3) == sources(3) != sources(4)


def test_trial_without_fixation_is_given_up_after_max_shifts():
    world = AngleWorld(objects=[])
    world.learner = lambda posture: np.array([0.05, 0.0])
    rounds = run(make_cycle(p_lm=1.0, max_shifts=3), world, 40)
    done = next(i for i, (_, d) in enumerate(rounds) if d.trials == 1)
    assert max(d.shifts for _, d in rounds[:done]) == 2
    shifted = {d.target[0].round(6) for _, d in rounds[:done] if d.phase is Phase.SHIFT}
    assert shifted == {0.05, 0.10, 0.15}
    assert rounds[done][1].target == pytest.approx((0, 0))
    assert rounds[done][1].phase is Phase.LOOK


@pytest.mark.parametrize('dead_images', [0, 1, 4])
def test_shift_has_not_arrived_before_the_head_has_moved(dead_images):
    """Before the servo starts, the head stands still, and on the wrong object."""
    world = AngleWorld(objects=[(0.25, 0.0), (0.09, 0.0)], dead_images=dead_images)
    cycle = make_cycle(settle_timeout_s=3.0)
    rounds = run(cycle, world, 30)
    done = next(i for i, (_, d) in enumerate(rounds) if d.trials == 1)
    percept = rounds[done][0]
    assert percept.posture.position == pytest.approx((0.25, 0.0))
    assert not percept.posture.velocity.any()


def test_shift_that_cannot_arrive_ends_after_the_settle_timeout():
    world = AngleWorld(objects=[])
    world.learner = lambda posture: np.array([0.5, 0.0])
    cycle = make_cycle(p_lm=1.0, settle_timeout_s=0.8)
    rounds = run(cycle, world, 5)
    assert cycle.step(world.percept()).phase is Phase.SHIFT
    start = next(p.posture.stamp_ns for p, d in rounds if d.phase is Phase.SHIFT)
    world.position, world.velocity = np.array([0.1, 0.0]), np.zeros(2)  # against a wall
    while (decision := cycle.step(world.percept())).shifts == 0:
        world.stamp_ns += 10**8
    assert world.stamp_ns - start == 8 * 10**8
    assert decision.target == pytest.approx((0.6, 0.0)), 'the next shift starts where it stands'


def test_shift_to_a_target_outside_the_limits_has_arrived_where_they_end():
    world = AngleWorld(objects=[])
    world.learner = lambda posture: np.array([0.5, 0.0])
    config = replace(CONFIG, settle_timeout_s=30.0)
    gating = Gating(GatingConfig(gating='constant', p_lm_max=1.0))
    wall = np.array([0.3, 0.2])

    def reachable(target):
        return np.clip(target, -wall, wall)

    cycle = AttentionCycle(config, gating, np.random.default_rng(0), reachable)
    shifts = []
    for _ in range(12):
        decision = cycle.step(world.percept())
        world.follow(reachable(decision.target))
        shifts.append(decision.shifts)
    assert max(shifts) >= 2


def test_lost_face_is_searched_and_found():
    world = AngleWorld(objects=[], face=(0.55, 0.0))
    rounds = run(make_cycle(search_after_s=1.0, search_period_s=8.0), world, 60)
    assert phases(rounds)[:3] == [Phase.LOOK, Phase.SEARCH, Phase.LOOK]
    assert first(rounds, Phase.SEARCH) == 10, 'not before search_after_s'
    found = next(i for i, (p, _) in enumerate(rounds) if p.face_delta is not None)
    assert rounds[found][1].phase is Phase.LOOK
    assert rounds[found][1].target == pytest.approx((0.55, 0.0))
    assert world.position == pytest.approx((0.55, 0.0), abs=CONFIG.look_tolerance_rad)


def test_sweep_of_the_search_covers_both_sides_of_home_and_keeps_its_amplitude():
    world = AngleWorld(face=None)
    cycle = make_cycle(home_pan_rad=0.2, search_pan_rad=0.5, search_tilt_rad=0.1)
    targets = np.array([d.target for _, d in run(cycle, world, 120) if d.phase is Phase.SEARCH])
    assert targets.min(axis=0) == pytest.approx((-0.3, -0.1), abs=0.01)
    assert targets.max(axis=0) == pytest.approx((0.7, 0.1), abs=0.01)


def test_head_looks_where_the_face_was_before_it_searches():
    world = AngleWorld(face=(0.2, 0.0))
    cycle = make_cycle(dwell_s=60.0)
    run(cycle, world, 10)
    world.face = None
    rounds = run(cycle, world, 10)
    assert {d.phase for _, d in rounds} == {Phase.LOOK}
    assert all(d.target == pytest.approx((0.2, 0.0)) for _, d in rounds)
    assert run(cycle, world, 1)[0][1].phase is Phase.SEARCH


def test_blink_of_the_detector_is_no_dwelling():
    """The dwell time starts from zero when a missed face comes back."""
    world = AngleWorld(objects=[(0.25, 0.0)])
    cycle = make_cycle(dwell_s=0.3, search_after_s=1.0)
    run(cycle, world, 2)
    face, world.face = world.face, None
    run(cycle, world, 5)
    world.face = face
    assert [d.phase for _, d in run(cycle, world, 4)] == [Phase.LOOK] * 3 + [Phase.SHIFT]


def test_long_dwelling_is_no_missing():
    world = AngleWorld()
    cycle = make_cycle(dwell_s=60.0, search_after_s=1.0)
    run(cycle, world, 30)
    world.face = None
    assert run(cycle, world, 1)[0][1].phase is Phase.LOOK


def test_moving_caregiver_is_followed():
    world = AngleWorld()
    cycle = make_cycle(dwell_s=0.5)
    for _ in range(30):
        world.face = world.face + np.array([0.05, 0.0])
        run(cycle, world, 1)
    assert cycle.phase is Phase.LOOK, 'never still, so no dwell'
    assert world.position == pytest.approx(world.face)


def test_home_ends_the_trial_and_looks_from_there():
    world = AngleWorld(objects=[(0.25, 0.0)])
    cycle = make_cycle(home_pan_rad=-0.3, home_tilt_rad=0.1)
    run(cycle, world, 4)
    assert cycle.phase is Phase.SHIFT
    cycle.go_home()
    rounds = run(cycle, world, 10)
    assert rounds[0][1].phase is Phase.HOME
    assert rounds[0][1].target == pytest.approx((-0.3, 0.1))
    arrived = first(rounds, Phase.LOOK)
    assert rounds[arrived][0].posture.position == pytest.approx((-0.3, 0.1))
    assert cycle.trials == 0


def test_restart_ends_the_shift_and_looks_where_the_caregiver_was():
    world = AngleWorld(objects=[(0.25, 0.0)])
    cycle = make_cycle()
    run(cycle, world, 4)
    world.face, world.position, world.velocity = None, np.array([0.4, 0.2]), np.zeros(2)
    cycle.restart()
    decision = cycle.step(world.percept())
    assert decision.phase is Phase.LOOK
    assert decision.shifts == 0
    assert decision.target == pytest.approx((0.0, 0.0))


def test_turn_home_goes_on_after_a_restart():
    cycle = make_cycle()
    cycle.go_home()
    cycle.restart()
    assert cycle.step(AngleWorld().percept()).phase is Phase.HOME


def test_posture_is_kept_when_nothing_was_ever_seen():
    world = AngleWorld(face=None)
    world.position = np.array([0.3, -0.1])
    decision = make_cycle().step(world.percept())
    assert decision.target == pytest.approx((0.3, -0.1))
    assert decision.source is Source.NONE


class GlancingWorld(AngleWorld):
    """A learner that proposes these views, one after the other, until the head has been there."""

    def __init__(self, views, **world):
        super().__init__(**world)
        self.views = [np.array(view) for view in views]

    def percept(self):
        percept = super().percept()
        self.views = [v for v in self.views if np.abs(v - self.position).max() > 0.02]
        wanted = self.views[0] - self.position if self.views else None
        return replace(percept, glance_delta=wanted)


def test_proposed_views_are_taken_before_the_first_shift():
    world = GlancingWorld([(0.4, 0.0), (-0.4, 0.0)], objects=[(0.1, 0.1)])
    rounds = run(make_cycle(), world, 40)
    assert phases(rounds)[:3] == [Phase.LOOK, Phase.GLANCE, Phase.SHIFT]
    glances = [d.target for _, d in rounds if d.phase is Phase.GLANCE]
    assert glances[0] == pytest.approx((0.4, 0.0))
    assert glances[-1] == pytest.approx((-0.4, 0.0))
    assert {d.source for _, d in rounds if d.phase is Phase.GLANCE} == {Source.GLANCE}


def test_fixation_in_a_glance_does_not_end_the_trial():
    world = GlancingWorld([(0.4, 0.0), (-0.4, 0.0)], objects=[(0.4, 0.02), (-0.4, 0.0)])
    rounds = run(make_cycle(), world, 40)
    glancing = [d for p, d in rounds if d.phase is Phase.GLANCE and p.fixation is not None]
    assert glancing, 'objects stand in the centre of the views'
    assert {d.trials for d in glancing} == {0}


@pytest.mark.parametrize(('most', 'taken'), [(0, 0), (1, 1), (3, 3)])
def test_glances_end_at_max_glances(most, taken):
    def always_more(world):
        world.views.append(world.position + np.array([0.1, 0.0]))

    world = GlancingWorld([(0.1, 0.0)], objects=[(0.3, 0.0)])
    cycle, targets = make_cycle(max_glances=most), []
    for _ in range(30):
        always_more(world)
        decision = cycle.step(world.percept())
        world.follow(decision.target)
        if decision.phase is Phase.GLANCE and decision.trials == 0:
            targets.append(tuple(decision.target))
    assert len(set(targets)) == taken
    assert cycle.trials >= 1


def test_gate_waits_for_a_late_fixation():
    """The evaluator answers only when the head has stood still for a while."""

    def shifts_of_first_trial(wait_s):
        world, cycle = AngleWorld(objects=[(0.2, 0.0)]), make_cycle(fixation_wait_s=wait_s)
        since_ns, shifts = None, 0
        while not cycle.trials:
            percept = world.percept()
            now_ns = percept.posture.stamp_ns
            since_ns = (since_ns or now_ns) if percept.fixation is not None else None
            if since_ns is None or now_ns - since_ns < 2e8:
                percept = replace(percept, fixation=None)
            decision = cycle.step(percept)
            world.follow(decision.target)
            shifts = max(shifts, decision.shifts)
        return shifts

    assert shifts_of_first_trial(0.25) == 0, 'the first shift is fixated'
    assert shifts_of_first_trial(0.0) > 0, 'given up before the evaluator could answer'


def test_the_gate_follows_the_evidence():
    gating = Gating(GatingConfig(gating='evidence'))
    cycle = AttentionCycle(CONFIG, gating, np.random.default_rng(0))
    world = AngleWorld(objects=[(0.2, 0.0)])
    world.learner = lambda posture: np.array([0.2, 0.0]) - posture
    for evidence, p_lm in [(-20.0, 0.0), (30.0, 1.0)]:
        decisions = []
        for _ in range(60):
            decisions.append(cycle.step(replace(world.percept(), log_evidence=evidence)))
            world.follow(decisions[-1].target)
        assert {round(d.p_lm, 3) for d in decisions} == {p_lm}
        wanted = Source.LEARNING_MODULE if p_lm else Source.VISUAL_FEEDBACK
        # The shift under way when the evidence changed was drawn before.
        assert {d.source for d in decisions[10:] if d.phase is Phase.SHIFT} == {wanted}


@pytest.mark.parametrize('bad', [np.nan, np.inf, -np.inf])
def test_a_face_or_a_speed_that_is_not_finite_is_neither_centred_nor_at_rest(bad):
    for face_delta, velocity in (((bad, 0.0), (0.0, 0.0)), ((0.0, 0.0), (bad, 0.0))):
        cycle = AttentionCycle(replace(CONFIG, dwell_s=0.0), Gating(GatingConfig()), None)
        posture = Posture(10**9, np.zeros(2), np.array(velocity))
        cycle.step(CycleInput(posture, face_delta=np.array(face_delta)))
        assert cycle.phase is Phase.LOOK


def test_search_starts_where_the_head_stands_and_never_rests():
    """At a rest an object could be fixated, as the end of a trial that was no trial."""
    world = AngleWorld(face=None)
    world.position = np.array([0.5, -0.2])
    cycle = make_cycle(search_after_s=0.5, search_period_s=8.0)
    rounds = run(cycle, world, 200)
    searching = rounds[first(rounds, Phase.SEARCH) :]
    targets = np.array([decision.target for _, decision in searching])
    assert targets[0] == pytest.approx((0.5, -0.2))
    steps = np.abs(np.diff(targets, axis=0)) / PERIOD_S
    assert steps.max() < 1.0, 'calm: half the speed of a shift'
    assert not any(percept.posture.is_still(0.05) for percept, _ in searching[3:])


def test_an_interrupted_look_is_no_trial_and_the_head_stays_where_it_looked_from():
    world = AngleWorld(objects=[(0.3, 0.0)], face=(0.0, 0.0))
    cycle = make_cycle(dwell_s=1.0, search_after_s=1.0)
    rounds = run(cycle, world, 4)
    world.face = np.array([0.12, 0.0])  # she gets up, is seen for one more image, and is gone
    rounds += run(cycle, world, 1)
    world.face = None
    rounds += run(cycle, world, 20)
    assert Phase.SHIFT not in phases(rounds)
    assert cycle.trials == 0
    waited = rounds[7 : first(rounds, Phase.SEARCH)]
    assert waited
    assert all(percept.posture.position == pytest.approx((0, 0)) for percept, _ in waited)


def test_time_without_a_person_counts_while_the_head_looks_or_searches():
    world = AngleWorld(objects=[(0.25, 0.1)])
    cycle = make_cycle()
    assert all(decision.phase in (Phase.LOOK, Phase.SHIFT) for _, decision in run(cycle, world, 9))
    assert cycle.unseen_s == 0.0
    while cycle.phase is not Phase.LOOK:
        run(cycle, world, 1)
    world.face = None
    run(cycle, world, 31)
    assert cycle.unseen_s == pytest.approx(3.0)
    assert cycle.phase is Phase.SEARCH
    world.face = np.zeros(2)
    while cycle.phase is Phase.SEARCH:
        run(cycle, world, 1)
    assert cycle.unseen_s == 0.0


def test_a_point_interrupts_the_trial_and_gives_the_head_back_to_the_caregiver():
    world = AngleWorld(objects=[(0.25, 0.1)], face=(0.0, 0.0))
    cycle = make_cycle(look_at_hold_s=1.0)
    rounds = run(cycle, world, 40)
    shift = first(rounds, Phase.SHIFT)
    world = AngleWorld(objects=[(0.25, 0.1)], face=(0.0, 0.0))
    cycle = make_cycle(look_at_hold_s=1.0)
    run(cycle, world, shift + 1)
    assert cycle.phase is Phase.SHIFT
    cycle.look_at(np.array([-0.4, 0.2]))
    assert cycle.is_interrupted
    rounds = run(cycle, world, 11)
    assert phases(rounds) == [Phase.LOOK_AT, Phase.LOOK]
    looked = [p.posture.stamp_ns for p, d in rounds if d.phase is Phase.LOOK_AT]
    assert (looked[-1] - looked[0]) * 1e-9 == pytest.approx(0.9)
    assert rounds[8][0].posture.position == pytest.approx((-0.4, 0.2))
    assert cycle.trials == 0, 'what it interrupts is no trial'
    after = run(cycle, world, 30)
    assert after[0][1].target == pytest.approx((0.0, 0.0)), 'back to where the face was'
    assert cycle.trials > 0


def test_each_new_point_counts_from_zero_and_is_followed():
    world = AngleWorld(face=(0.0, 0.0))
    cycle = make_cycle(look_at_hold_s=0.5)
    run(cycle, world, 3)
    for step in range(30):
        cycle.look_at(np.array([0.02 * step, 0.0]))
        (last,) = run(cycle, world, 1)
        assert last[1].phase is Phase.LOOK_AT
        assert last[1].target == pytest.approx((0.02 * step, 0.0))


@pytest.mark.parametrize('seen', [True, False])
def test_a_point_that_is_cleared_no_longer_moves_the_head(seen):
    world = AngleWorld(face=(0.0, 0.0) if seen else None)
    cycle = make_cycle()
    run(cycle, world, 3)
    assert not cycle.end_look_at()
    cycle.look_at(np.array([0.8, 0.0]))
    run(cycle, world, 2)
    assert cycle.end_look_at()
    stopped = world.position.copy()
    rounds = run(cycle, world, 5)
    assert {d.phase for _, d in rounds} == {Phase.LOOK}
    assert world.position == pytest.approx((0.0, 0.0) if seen else stopped)


@pytest.mark.parametrize('end', ['home', 'restart'])
def test_home_and_a_hold_end_a_look_at_a_point(end):
    world = AngleWorld(face=(0.0, 0.0))
    cycle = make_cycle()
    run(cycle, world, 3)
    cycle.look_at(np.array([0.8, 0.0]))
    run(cycle, world, 2)
    cycle.go_home() if end == 'home' else cycle.restart()
    assert cycle.phase is (Phase.HOME if end == 'home' else Phase.LOOK)
    cycle.look_at(np.array([0.8, 0.0]))
    assert cycle.phase is Phase.LOOK_AT, 'the newest request counts'
