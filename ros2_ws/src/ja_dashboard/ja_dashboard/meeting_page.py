"""The page of a meeting: what a person in front of the camera reads, without ROS.

The server sends what is to be shown as data, and `meeting_board.js` lays it out: Vue escapes each
text.
"""

from dataclasses import asdict
from pathlib import Path
from typing import Any, Protocol

from nicegui import ui
from nicegui.events import GenericEventArguments

from ja_common.core.request_phase import RequestPhase
from ja_dashboard.core.meeting_view import MeetingView, marks_in_picture, report_file

MEETING_URL = '/meet'
FULL_VIEW_URL = '/view'
PLAIN_PICTURE_URL = '/meet/picture.jpg'
REPORT_URL = '/meet/report.html'
_EVERY_S = 0.1
_PAUSE, _END, _MOVED = 'caregiver/pause', 'caregiver/end', 'caregiver/rearranged'
_CONTROLS = {'pause': _PAUSE, 'end': _END, 'moved': _MOVED}
_STYLE = Path(__file__).with_name('meeting_board.css')
_IDLE = 'idle'
_NO_MEETING = 'No meeting runs. Start one with: ./ja meet'
_SILENT = 'The meeting is silent.'


class MeetingModel(Protocol):
    """What the page of a meeting needs: frames to show, and requests to pass on."""

    @property
    def frame(self) -> Any: ...
    def note_viewer(self) -> None: ...
    def call_switch(self, service: str, on: bool) -> None: ...
    def call_trigger(self, service: str) -> None: ...
    def report_failure(self, where: str, error: Exception) -> None: ...


class MeetingBoard(ui.element, component='meeting_board.js'):
    """The elements of the page in the browser; it shows `board`, see `board_of`."""

    def __init__(self, board: dict[str, Any]) -> None:
        super().__init__()
        self._props['board'] = board

    @property
    def board(self) -> dict[str, Any]:
        """Return what is shown."""
        return self._props['board']

    def show(self, board: dict[str, Any]) -> None:
        """Show another board; nothing is sent for an equal one."""
        if board != self.board:
            self._props['board'] = board


class MeetingPage:
    """One open page of a meeting."""

    def __init__(self, model: MeetingModel) -> None:
        self._model = model
        # Not ui.add_css, whose inline script the page's policy refuses.
        ui.add_head_html(f'<style>{_STYLE.read_text()}</style>')
        ui.page_title('Joint attention: you are the caregiver')
        self._board = MeetingBoard(board_of(model.frame))
        self._board.on('pause', self._pause)
        self._board.on('end', lambda: model.call_trigger(_END))
        self._board.on('moved', lambda: model.call_trigger(_MOVED))
        ui.timer(_EVERY_S, self._show)

    def _pause(self, event: GenericEventArguments) -> None:
        self._model.call_switch(_PAUSE, event.args is True)

    def _show(self) -> None:
        self._model.note_viewer()
        try:
            self._board.show(board_of(self._model.frame))
        except Exception as error:
            self._model.report_failure('page of the meeting', error)


def board_of(frame: Any) -> dict[str, Any]:
    """Return what the page shows of a frame, as JSON."""
    meeting: MeetingView = frame.meeting or MeetingView(message=_NO_MEETING)
    phase = _IDLE if frame.meeting is None else meeting.phase.value
    return {
        'phase': phase,
        'message': _SILENT if meeting.is_silent else meeting.message,
        'silent': meeting.is_silent,
        'number': meeting.number,
        'trial': meeting.trial,
        'trials': meeting.trials,
        'answer': meeting.answer,
        'right': meeting.right,
        'learner': meeting.learner and asdict(meeting.learner),
        'successes': meeting.successes,
        'chance': meeting.chance,
        'film': meeting.film,
        'report': _report_of(meeting),
        'controls': [name for name, service in _CONTROLS.items() if service in frame.services],
        **_picture_of(frame, meeting),
    }


def _picture_of(frame: Any, meeting: MeetingView) -> dict[str, Any]:
    picture, scene = frame.picture, frame.scene
    if picture is None:
        return {'picture': '', 'aspect': 4 / 3, 'live': False, 'marks': []}
    posture = None if scene is None else scene.posture
    marks = [] if posture is None else marks_in_picture(meeting.things, posture, picture.camera)
    height, width = picture.image.shape[:2]
    return {
        'picture': f'{PLAIN_PICTURE_URL}?{picture.stamp_ns}',
        'aspect': width / height,
        'live': frame.state.is_live,
        'marks': [asdict(mark) for mark in marks],
    }


def _report_of(meeting: MeetingView) -> dict[str, str]:
    """Return the address of the report, '' if it lies on another machine, and its path."""
    if meeting.phase is not RequestPhase.ENDED or not meeting.report:
        return {'address': '', 'path': ''}
    address = REPORT_URL if report_file(meeting.report) else ''
    return {'address': address, 'path': meeting.report}
