import pytest

from pipeline import provenance


@pytest.fixture
def project(tmp_path, monkeypatch):
    (tmp_path / "fea").mkdir()
    (tmp_path / "fea" / "kernels.py").write_text("x = 1\n", encoding="utf-8")
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / "store.py").write_text("y = 1\n", encoding="utf-8")
    monkeypatch.setattr(provenance, "ROOT", tmp_path)
    return tmp_path


def test_an_edited_kernel_changes_the_hash(project):
    read = provenance.source_hash.__wrapped__
    before = read("fea", "results.store")
    assert read("fea", "results.store") == before
    (project / "fea" / "__pycache__").mkdir()
    (project / "fea" / "__pycache__" / "kernels.nbi").write_bytes(b"cache")
    assert read("fea", "results.store") == before
    (project / "fea" / "kernels.py").write_text("x = 2\n", encoding="utf-8")
    assert read("fea", "results.store") != before
    assert read("results.store") == read("results.store")


def test_a_source_that_is_gone_is_no_silent_hole(project):
    with pytest.raises(FileNotFoundError):
        provenance.source_hash.__wrapped__("results.stored")


def test_versions_and_commit_are_known():
    found = provenance.provenance(("lab",))
    assert set(found) == {"source_hash", "git_commit", "git_dirty", "versions", "platform"}
    assert found["versions"]["numpy"] != "not installed"
