"""Films and cameras at an address: a web server on this computer, and what breaks off."""

import functools
import http.server
import threading
import time

import cv2
import numpy as np
import pytest

from ja_perception.core.film import Film
from ja_perception.core.frame_sources import NotYetError, SourceError, SourceOptions
from ja_perception.core.live_sources import Stream, shown_url
from ja_perception.core.open_source import open_source
from picture_files import flat, write_film
from ros_testing import PATIENCE_S

RED, GREEN = (200, 0, 0), (0, 200, 0)


def ignore(where, text):
    pass


class QuietHandler(http.server.SimpleHTTPRequestHandler):
    """Serves files, and at /live a stream of JPEGs that breaks off after a few."""

    pictures_each = 20
    connections = 0

    def log_message(self, *args):
        pass

    def do_GET(self):
        if self.path.partition('?')[0] != '/live.mjpg':
            return super().do_GET()
        QuietHandler.connections += 1
        self.send_response(200)
        self.send_header('Content-Type', 'multipart/x-mixed-replace; boundary=frame')
        self.end_headers()
        jpeg = cv2.imencode('.jpg', flat(GREEN)[..., ::-1])[1].tobytes()
        head = b'--frame\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n' % len(jpeg)
        try:
            for _ in range(self.pictures_each):
                self.wfile.write(head + jpeg + b'\r\n')
                time.sleep(0.01)
        except OSError:
            pass
        self.close_connection = True
        return None


@pytest.fixture
def server(tmp_path):
    handler = functools.partial(QuietHandler, directory=str(tmp_path))
    server = http.server.ThreadingHTTPServer(('127.0.0.1', 0), handler)
    server.daemon_threads = True
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f'http://127.0.0.1:{server.server_address[1]}'
    server.shutdown()
    server.server_close()


def next_picture(source, timeout_s=PATIENCE_S):
    deadline_s = time.monotonic() + timeout_s
    while time.monotonic() < deadline_s:
        try:
            return source.next_frame()
        except (NotYetError, SourceError):
            time.sleep(0.01)
    raise AssertionError('no picture')


def test_a_film_at_an_address_keeps_its_times_and_restarts(server, tmp_path):
    write_film(tmp_path / 'clip.avi', [flat(RED), flat(GREEN)], 12.0)
    source = open_source(f'{server}/clip.avi', SourceOptions(), ignore)
    assert isinstance(source, Film)
    names = [('red', 'green')[source.next_frame()[24, 32].argmax()] for _ in range(3)]
    source.close()
    assert names == ['red', 'green', 'red']
    assert source.period_s == pytest.approx(1 / 12)


def test_a_live_stream_is_opened_again_when_it_breaks_off(server):
    source = open_source(f'{server}/live.mjpg?password=secret', SourceOptions(), ignore)
    assert isinstance(source, Stream)
    assert 'secret' not in source.summary
    before = QuietHandler.connections
    deadline_s = time.monotonic() + PATIENCE_S
    while QuietHandler.connections == before:
        assert np.abs(next_picture(source)[24, 32].astype(int) - GREEN).max() < 10
        assert time.monotonic() < deadline_s
    source.close()


class FakeCapture:
    """Delivers so many pictures, then breaks off."""

    def __init__(self, count):
        self.left = count

    def read(self):
        self.left -= 1
        return (True, flat(RED)) if self.left >= 0 else (False, None)

    def release(self):
        pass


def test_a_camera_that_stays_away_is_named_with_its_reason(monkeypatch):
    monkeypatch.setattr('ja_perception.core.live_sources._SILENT_AFTER_S', 0.2)
    monkeypatch.setattr('ja_perception.core.live_sources._RETRY_S', 0.01)

    def refuse(url):
        raise SourceError('the camera refuses')

    source = Stream('rtsp://me:secret@eye/1', SourceOptions(), FakeCapture(1), refuse)
    next_picture(source)
    text = error_of(source)
    source.close()
    assert "stream 'rtsp://eye/1' gives no picture for" in text
    assert 'the camera refuses' in text


def error_of(source, timeout_s=PATIENCE_S):
    deadline_s = time.monotonic() + timeout_s
    while time.monotonic() < deadline_s:
        try:
            source.next_frame()
        except NotYetError:
            time.sleep(0.01)
        except SourceError as error:
            return str(error)
    raise AssertionError('no error')


def test_an_address_that_nothing_answers_is_named_without_its_password():
    with pytest.raises(
        SourceError, match=r"'http://127\.0\.0\.1:9/a\.mp4' cannot be opened"
    ) as error:
        open_source('http://me:secret@127.0.0.1:9/a.mp4', SourceOptions(), ignore)
    assert 'secret' not in str(error.value)


def test_logs_show_no_password():
    assert shown_url('rtsp://a:b@host:554/x?token=1#2') == 'rtsp://host:554/x'
    assert shown_url('folder/a?b.mp4') == 'folder/a?b.mp4'
