"""Who may open the live page: hosts and origins, by the rules alone."""

import pytest

from ja_common.core.config import ConfigError
from ja_dashboard.core.access import AccessRules, RequestHead, listed_hosts, own_hosts

PORT = 8080
RULES = AccessRules(
    [*own_hosts('127.0.0.1', 'robot', serves_others=False), 'lab.example:8080', 'tunnel.example'],
    PORT,
    None,
)


def status(*headers, **request):
    refusal = RULES.refusal(RequestHead(headers, request.pop('path', '/'), **request))
    return refusal.status if refusal else 200


@pytest.mark.parametrize(
    'host',
    ['localhost:8080', '127.0.0.1:8080', '[::1]:8080', 'LocalHost:8080', 'lab.example:8080',
     'tunnel.example:8080'],
)  # fmt: skip
def test_own_hosts_are_answered_also_in_capitals(host):
    assert status(('host', host)) == 200


@pytest.mark.parametrize(
    'host',
    ['evil.example', 'evil.example:8080', 'localhost', 'localhost:80', 'localhost:8081',
     'localhost:', 'localhost:08080', 'localhost.:8080', 'localhost:8080.evil.example',
     'localhost.evil.example:8080', 'x@localhost:8080', 'localhost:8080@evil.example',
     'localhost:8080, evil.example', ' localhost:8080', '::1:8080', '[::1]', '[::1%lo]:8080',
     '[::ffff:127.0.0.1]:8080', '127.1:8080', '2130706433:8080', '0x7f000001:8080',
     '0.0.0.0:8080', '127.0.0.1.:8080', 'robot:8080', 'lab.example', 'l\u00f6calhost:8080', '',
     'localhost:\u0668\u0660\u0668\u0660'],
)  # fmt: skip
def test_any_other_host_is_refused(host):
    assert status(('host', host)) == 421


def test_a_request_has_exactly_one_host():
    assert status() == 400
    assert status(('host', 'localhost:8080'), ('host', 'localhost:8080')) == 400


@pytest.mark.parametrize(
    ('server', 'host', 'answered'),
    [
        (('192.0.2.7', PORT), '192.0.2.7:8080', 200),
        (('192.0.2.7', PORT), '192.0.2.8:8080', 421),
        (('192.0.2.7', PORT), '192.0.2.7', 421),
        (('192.0.2.7', 80), '192.0.2.7', 200),
        (('fe80::1%eth0', PORT), '[fe80::1]:8080', 200),
        (('::ffff:192.0.2.7', PORT), '192.0.2.7:8080', 200),
        (None, '192.0.2.7:8080', 421),
    ],
)
def test_the_address_at_which_a_connection_arrives_is_a_host(server, host, answered):
    assert status(('host', host), server=server) == answered


def test_machine_names_count_where_other_machines_are_served():
    hosts = own_hosts('0.0.0.0', 'Robot.lab.example', serves_others=True)
    rules = AccessRules(hosts, PORT, 'secret')
    for host in ('robot:8080', 'robot.lab.example:8080', 'robot.local:8080', 'localhost:8080'):
        assert rules.refusal(RequestHead([('host', host)], '/')) is None
    assert rules.refusal(RequestHead([('host', 'lab.example:8080')], '/')).status == 421


def test_the_port_of_http_may_be_left_out():
    rules = AccessRules(['localhost'], 80, None)
    for host in ('localhost', 'localhost:80'):
        assert rules.refusal(RequestHead([('host', host)], '/')) is None


@pytest.mark.parametrize(
    'origin',
    ['http://evil.example', 'https://localhost:8080', 'http://localhost', 'http://127.0.0.1:8080',
     'http://localhost:8081', 'http://localhost:8080/', 'ws://localhost:8080', 'null', ''],
)  # fmt: skip
@pytest.mark.parametrize('is_socket', [True, False])
def test_a_foreign_origin_is_refused(origin, is_socket):
    head = (('host', 'localhost:8080'), ('origin', origin))
    assert status(*head, is_socket=is_socket) == 403


def test_a_socket_needs_the_origin_of_the_page():
    host, own = ('host', 'localhost:8080'), ('origin', 'http://localhost:8080')
    assert status(host, own, is_socket=True) == 200
    assert status(host, is_socket=True) == 403
    assert status(host, own, own, is_socket=True) == 403
    assert status(host, own, ('origin', 'http://evil.example'), is_socket=True) == 403
    assert status(host) == 200


@pytest.mark.parametrize(
    ('site', 'destination', 'answered'),
    [
        ('same-origin', 'image', 200),
        ('none', 'document', 200),
        ('cross-site', 'image', 403),
        ('same-site', 'script', 403),
        ('cross-site', 'iframe', 403),
        ('cross-site', 'empty', 403),
        ('cross-site', 'document', 200),
    ],
)
def test_another_site_may_link_to_the_page_and_no_more(site, destination, answered):
    fetched = (('sec-fetch-site', site), ('sec-fetch-dest', destination))
    assert status(('host', 'localhost:8080'), *fetched) == answered


@pytest.mark.parametrize('method', ['POST', 'PUT', 'DELETE', 'OPTIONS', 'TRACE', 'get', 'CONNECT'])
def test_it_answers_reading_methods_only(method):
    assert status(('host', 'localhost:8080'), method=method) == 405


@pytest.mark.parametrize('path', ['http://evil.example/', '*', '', 'evil.example:443'])
def test_it_is_no_proxy(path):
    assert status(('host', 'localhost:8080'), path=path) == 400


@pytest.mark.parametrize(
    'host',
    ['*', 'http://lab', 'lab/', 'lab:0', 'lab:99999', 'lab:x', 'user@lab', 'fe80::1', '[x]'],
)
def test_a_host_that_is_none_is_refused_with_a_sentence(host):
    with pytest.raises(ConfigError, match='is no NAME or NAME:PORT'):
        AccessRules([host], PORT, None)


def test_listed_hosts_stand_between_commas_or_spaces():
    assert listed_hosts(' lab, robot:80  x ') == ['lab', 'robot:80', 'x']
    assert listed_hosts('') == []


def test_only_the_whole_token_counts():
    rules = AccessRules(['localhost'], PORT, 'secret')
    assert rules.is_token('secret')
    for text in (None, '', 'secre', 'secrets', 'SECRET', 's\u00e9cret'):
        assert not rules.is_token(text)
