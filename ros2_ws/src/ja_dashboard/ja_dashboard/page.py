"""The elements of the live page, without ROS: it reads frames and passes requests on."""

from collections.abc import Sequence
from html import escape
from typing import Any, Protocol

from fastapi import Response
from fastapi.responses import RedirectResponse
from nicegui import ui

from ja_common.core.health import Level
from ja_dashboard.core import drawings
from ja_dashboard.core.view_model import CurvePoints, NodeHealth, RunState
from ja_dashboard.meeting_page import MEETING_URL, MeetingModel, MeetingPage

PICTURE_URL = '/picture.jpg'
_PICTURE_EVERY_S = 0.1
_OTHERS_EVERY_S = 0.25
_SPEEDS = {0.0: 'as fast as possible', 0.25: '¼ x', 0.5: '½ x', 1.0: '1 x', 2.0: '2 x', 5.0: '5 x'}
_COLOURS = {
    RunState.WAITING: 'grey',
    RunState.RUNNING: 'green',
    RunState.PAUSED: 'blue',
    RunState.HELD: 'orange',
    RunState.STOPPED: 'red',
}
_LEVEL_COLOURS = {
    Level.OK: '#22c55e', Level.WARN: '#f59e0b', Level.ERROR: '#ef4444', Level.STALE: '#64748b',
}  # fmt: skip
_STYLE = """
.ja-page { display: grid; gap: 12px; width: 100%; align-items: start;
           grid-template-columns: repeat(auto-fit, minmax(min(100%, 21rem), 1fr)) }
.ja-card { background: #1e293b; border-radius: 10px; padding: 12px; min-width: 0 }
.ja-card h2 { font-size: .8rem; letter-spacing: .05em; text-transform: uppercase; color: #94a3b8;
              margin: 0 0 6px; line-height: 1.4 }
.ja-old { filter: grayscale(1) brightness(.45) }
.ja-facts { display: grid; grid-template-columns: auto 1fr; gap: 2px 14px; font-size: .9rem }
.ja-facts dt { color: #94a3b8 } .ja-facts dd { margin: 0; font-variant-numeric: tabular-nums;
                                        min-width: 0; overflow-wrap: anywhere;
                                        white-space: pre-line }
.ja-nodes { width: 100%; font-size: .82rem; border-spacing: 0 3px; border-collapse: separate }
.ja-nodes td { vertical-align: top; padding-right: 8px; overflow-wrap: anywhere }
.ja-light { display: inline-block; width: .7em; height: .7em; border-radius: 50% }
.ja-log * { white-space: pre-wrap; overflow-wrap: anywhere }
.ja-quiet { color: #94a3b8 }
body { background: #0f172a }
"""


class PageModel(MeetingModel, Protocol):
    """What the page needs of a `ViewNode`: frames to show, and requests to pass on."""

    def show_truth(self, shown: bool) -> None: ...
    def set_remote_parameter(self, name: str, value: Any) -> None: ...


class Page:
    """Makes the page for every browser that opens it."""

    def __init__(self, model: PageModel) -> None:
        self._model = model

    def build(self) -> Response | None:
        """Build the page that a browser asks for; while a meeting runs, the first is its own."""
        request = ui.context.client.request
        path = request.url.path if request is not None else '/'
        meeting = self._model.frame.meeting
        if path == MEETING_URL:
            MeetingPage(self._model)
        elif path == '/' and meeting is not None and not meeting.is_silent:
            return RedirectResponse(MEETING_URL, 307)
        else:
            _OpenPage(self._model, leads_to_meeting=path == '/')
        return None


class _OpenPage:
    """One open page."""

    def __init__(self, model: PageModel, leads_to_meeting: bool) -> None:
        self._model = model
        self._leads_to_meeting = leads_to_meeting
        self._shown_log = 0
        self._shown_stamp = 0
        self._curve: CurvePoints | None = None
        # The last known state of the switches and settings; `_mirroring` while the page shows it.
        self._mirrored: dict[str, Any] = {}
        self._mirroring = False
        ui.add_head_html(f'<style>{_STYLE}</style>')
        with ui.row().classes('w-full items-center gap-2'):
            ui.label('Joint attention').classes('text-lg font-medium')
            self._badge = ui.badge('').mark('state').classes('text-sm px-2 py-1')
            self._why = ui.label().mark('why').classes('ja-quiet text-sm')
            self._meeting = ui.link('the meeting', MEETING_URL).classes('text-sm ml-auto')
        self._add_controls()
        with ui.element('div').classes('ja-page'):
            with self._card('What it sees'):
                self._picture = ui.interactive_image().classes('w-full')
            with self._card('The scene from above'):
                self._scene = ui.html(sanitize=False).classes('w-full')
                ui.label(
                    'Orange: detected objects. Yellow: her face. Violet: belief of the learner, '
                    'directions only. Green: the truth. Pink: her gaze, as read from landmarks. '
                    'Without a range the distance is arbitrary: a camera measures directions.'
                ).classes('ja-quiet text-xs')
            with self._card('Pan and tilt within their limits'):
                self._postures = ui.html(sanitize=False).classes('w-full')
                ui.label('blue: what is in view; pink cross: the command').classes(
                    'ja-quiet text-xs'
                )
            with self._card('Learning'):
                self._facts = ui.html(sanitize=False).mark('facts')
                self._chart = ui.echart(_chart_options()).classes('w-full').style('height: 190px')
            with self._card('Nodes'):
                self._nodes = ui.html(sanitize=False).mark('nodes')
            with self._card('Log'):
                self._log = ui.log(max_lines=200).classes('ja-log w-full text-xs')
                self._log.style('height: 220px')
        ui.timer(_PICTURE_EVERY_S, self._show_picture)
        ui.timer(_OTHERS_EVERY_S, self._show_others)
        self._show_others()

    @staticmethod
    def _card(title: str) -> ui.element:
        card = ui.element('section').classes('ja-card')
        with card:
            ui.element('h2').props(f'innerHTML="{escape(title)}"')
        return card

    def _add_controls(self) -> None:
        model = self._model
        with ui.row().classes('w-full items-center gap-2 mb-2') as row:
            self._switches = {
                'sim/pause': self._switch('pause', 'sim/pause'),
                'gate/enable': self._switch('enabled', 'gate/enable'),
            }
            self._buttons = {
                'sim/step': self._button('one step', 'sim/step'),
                'sim/rearrange': self._button('rearrange', 'sim/rearrange'),
                'gate/home': self._button('home', 'gate/home'),
                'save_checkpoint': self._button('save checkpoint', 'save_checkpoint'),
                'reset_learning': ui.button('reset learning', on_click=self._ask_to_reset)
                .props('outline dense no-caps color=red')
                .mark('reset_learning'),
            }
            self._settings = {
                'real_time_factor': self._select('speed', 'real_time_factor', _SPEEDS),
                'objects': self._select(
                    'objects', 'objects', {0: 'as the scene', **{n: str(n) for n in range(1, 11)}}
                ),
                'learner': self._select('learner', 'learner', {}),
            }
            self._truth = ui.switch('the truth', on_change=lambda e: model.show_truth(e.value))
        row.style('row-gap: 4px')

    def _switch(self, text: str, service: str) -> ui.switch:
        def set_switch(on: bool) -> None:
            if not self._mirroring:
                self._model.call_switch(service, on)

        return ui.switch(text, on_change=lambda e: set_switch(e.value)).mark(service)

    def _button(self, text: str, service: str) -> ui.button:
        button = ui.button(text, on_click=lambda: self._model.call_trigger(service))
        return button.props('outline dense no-caps').mark(service)

    def _select(self, label: str, name: str, options: dict[Any, str]) -> ui.select:
        def set_value(value: Any) -> None:
            if not self._mirroring:
                self._model.set_remote_parameter(name, value)

        select = ui.select(options, label=label, on_change=lambda e: set_value(e.value)).mark(name)
        return select.props('dense options-dense').classes('min-w-28')

    async def _ask_to_reset(self) -> None:
        with ui.dialog() as dialog, ui.card():
            ui.label('The learner will start from initial weights.')
            with ui.row():
                ui.button('forget everything', on_click=lambda: dialog.submit(True)).props(
                    'color=red'
                )
                ui.button('keep everything', on_click=lambda: dialog.submit(False))
        if await dialog:
            self._model.call_trigger('reset_learning')
        dialog.delete()

    def _show_picture(self) -> None:
        """Set the address of the newest picture; the browser loads it after the last one."""
        self._model.note_viewer()
        picture = self._model.frame.picture
        if picture is not None and picture.stamp_ns != self._shown_stamp:
            self._shown_stamp = picture.stamp_ns
            self._picture.set_source(f'{PICTURE_URL}?{picture.stamp_ns}')

    def _show_others(self) -> None:
        """Show the frame; a part that fails is reported, and the others are shown."""
        frame = self._model.frame
        for show in (
            self._show_meeting,
            self._show_state,
            self._show_scene,
            self._show_nodes,
            self._show_controls,
            self._show_curve,
            self._show_log,
        ):
            try:
                show(frame)
            except Exception as error:
                self._model.report_failure(f'page, {show.__name__}', error)

    def _show_meeting(self, frame: Any) -> None:
        self._meeting.set_visibility(frame.meeting is not None)
        if self._leads_to_meeting and frame.meeting is not None and not frame.meeting.is_silent:
            self._leads_to_meeting = False
            ui.navigate.to(MEETING_URL)

    def _show_state(self, frame: Any) -> None:
        self._badge.set_text(frame.state.run.value)
        self._badge.props(f'color={_COLOURS[frame.state.run]}')
        self._why.set_text(frame.state.text)
        for shown in (self._picture, self._scene, self._postures):
            old = not (frame.state.is_live or frame.state.run is RunState.PAUSED)
            shown.classes(add='ja-old' if old else '', remove='' if old else 'ja-old')
        self._facts.set_content(facts_html(frame.facts))

    def _show_scene(self, frame: Any) -> None:
        if frame.scene is not None:
            self._scene.set_content(drawings.from_above(frame.scene))
            self._postures.set_content(drawings.postures(frame.scene))

    def _show_nodes(self, frame: Any) -> None:
        self._nodes.set_content(nodes_html(frame.node_health, frame.latencies_ms))

    def _show_controls(self, frame: Any) -> None:
        for name, element in {**self._buttons, **self._switches}.items():
            element.set_visibility(name in frame.services)
        self._truth.set_visibility('sim/step' in frame.services)
        for name, choices in frame.choices.items():
            self._settings[name].set_options({choice: choice for choice in choices})
        for name, select in self._settings.items():
            select.set_visibility(name in frame.settings)
        self._mirror({**self._switches, **self._settings}, {**frame.switches, **frame.settings})

    def _show_curve(self, frame: Any) -> None:
        if frame.curve is not self._curve:
            self._curve = frame.curve
            _fill_chart(self._chart, frame.curve)

    def _show_log(self, frame: Any) -> None:
        for number, line in frame.log:
            if number > self._shown_log:
                self._shown_log = number
                self._log.push(line)

    def _mirror(self, elements: dict[str, Any], values: dict[str, Any]) -> None:
        """Show values that have changed; a value that the viewer just chose stays."""
        self._mirroring = True
        try:
            for name, value in values.items():
                if name not in self._mirrored or self._mirrored[name] != value:
                    self._mirrored[name] = value
                    element = elements[name]
                    if isinstance(element, ui.select) and value not in element.options:
                        element.set_options({**dict(element.options), value: str(value)})
                    element.set_value(value)
        finally:
            self._mirroring = False


def facts_html(facts: dict[str, str]) -> str:
    """Return names and values in two columns."""
    rows = ''.join(f'<dt>{escape(k)}</dt><dd>{escape(v)}</dd>' for k, v in facts.items())
    return f'<dl class="ja-facts">{rows}</dl>'


def nodes_html(node_health: Sequence[NodeHealth], latencies_ms: dict[str, float]) -> str:
    """Return the level, message and rates of each node, then the latencies of the last image."""
    rows = []
    for health in node_health:
        colour = _LEVEL_COLOURS[health.level]
        rates = [
            f'{key.removesuffix(" rate [1/s]")} {value}/s'
            for key, value in health.values.items()
            if key.endswith(' rate [1/s]')
        ]
        others = [
            f'{key} {value}'
            for key, value in health.values.items()
            if not key.endswith((' rate [1/s]', ' received'))
        ]
        message = escape(health.message) if health.level else ''
        figures = escape(', '.join([*others, *rates]))
        rows.append(
            f'<tr><td><span class="ja-light" style="background:{colour}" '
            f'title="{health.level.name}"></span></td><td>{escape(health.node.lstrip("/"))}'
            f'<div>{message}</div><div class="ja-quiet">{figures}</div></td></tr>'
        )
    latencies = ', '.join(f'{name} {ms:.1f} ms' for name, ms in latencies_ms.items())
    after = (
        f'<div class="ja-quiet text-xs">after an image: {escape(latencies)}</div>'
        if latencies
        else ''
    )
    return f'<table class="ja-nodes">{"".join(rows)}</table>{after}'


def _chart_options() -> dict[str, Any]:
    line = {'type': 'line', 'showSymbol': False, 'data': []}
    thin = {**line, 'lineStyle': {'opacity': 0.0}, 'stack': 'interval', 'tooltip': {'show': False}}
    return {
        'animation': False,
        'grid': {'left': 34, 'right': 8, 'top': 28, 'bottom': 24},
        'legend': {'top': 0, 'data': ['success', 'p(LM)'], 'textStyle': {'color': '#94a3b8'}},
        'xAxis': {'type': 'value', 'max': 'dataMax', 'splitLine': {'show': False}},
        'yAxis': {
            'type': 'value',
            'min': 0,
            'max': 1,
            'splitLine': {'lineStyle': {'color': '#334155'}},
        },
        'tooltip': {'trigger': 'axis'},
        'series': [
            {**thin, 'name': 'low'},
            {**thin, 'name': 'interval', 'areaStyle': {'opacity': 0.25, 'color': '#38bdf8'}},
            {**line, 'name': 'success', 'color': '#38bdf8'},
            {**line, 'name': 'p(LM)', 'color': '#f472b6', 'lineStyle': {'type': 'dashed'}},
        ],
    }


def _fill_chart(chart: ui.echart, curve: CurvePoints) -> None:
    widths = [high - low for low, high in zip(curve.low, curve.high, strict=True)]
    columns = (curve.low, widths, curve.rate, curve.p_lm)
    for series, column in zip(chart.options['series'], columns, strict=True):
        series['data'] = [list(point) for point in zip(curve.trials, column, strict=True)]
    chart.update()
