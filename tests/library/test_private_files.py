"""Whether nobody can change a file who may not: where code is taken from."""

import os
import sys
from types import SimpleNamespace

import pytest

from magmotor.common.files import is_private

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no owners like these")


@pytest.mark.parametrize(
    ("name", "members", "is_own"),
    [("user", [], True), ("user", ["user"], True), ("user", ["other"], False), ("users", [], False),
     (None, [], False)],
)  # fmt: skip
def test_the_group_that_a_user_has_alone_is_the_user(name, members, is_own, tmp_path, monkeypatch):
    """With a umask of 002, which many systems set for such groups, all files are open to them."""

    def group(_):
        if name is None:
            raise KeyError
        return SimpleNamespace(gr_name=name, gr_mem=members)

    monkeypatch.setattr("pwd.getpwuid", lambda _: SimpleNamespace(pw_name="user"))
    monkeypatch.setattr("grp.getgrgid", group)
    path = tmp_path / "file"
    path.touch()
    path.chmod(0o664)
    assert is_private(str(path)) == is_own


def test_a_link_is_as_private_as_what_it_leads_to(tmp_path):
    path, link = tmp_path / "file", tmp_path / "link"
    path.touch()
    link.symlink_to("file")
    assert is_private(str(link))
    path.chmod(0o666)
    assert not is_private(str(link))


def test_in_a_folder_for_all_users_each_has_private_files(tmp_path):
    """As in that for temporary files, where nobody can replace what another has made."""
    path = tmp_path / "file"
    path.touch()
    tmp_path.chmod(0o1777)
    assert is_private(str(path))
    assert not is_private(str(tmp_path))


def test_the_files_of_the_user_are_private(tmp_path, monkeypatch):
    path = tmp_path / "file"
    path.touch()
    try:
        os.chown(path, 4321, -1)
    except PermissionError:
        pytest.skip("only root can give a file away")
    assert not is_private(str(path))
    monkeypatch.setattr(os, "getuid", lambda: 4321)
    assert is_private(str(path))
