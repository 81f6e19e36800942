import pytest

from lab.published import DATA, figures, locate, read_stiffness_table


def test_table_5_1_is_complete():
    table = read_stiffness_table(DATA / "table_5_1.csv")
    assert table.origin == "lab"
    assert set(table.rows) == {0, 45, -45, 90, -90}
    assert all(len(row) == 9 for row in table.rows.values())


def test_table_5_1_agrees_with_the_published_equations():
    """Table 5.1 and eqs 5.7 to 5.11 print the same numbers; the two data files were made apart."""
    table = read_stiffness_table(DATA / "table_5_1.csv")
    names = {
        0: "eq5.7-Kprime-0",
        45: "eq5.8-Kprime-45",
        -45: "eq5.9-Kprime-m45",
        90: "eq5.10-Kprime-90",
        -90: "eq5.11-Kprime-m90",
    }
    for phi, row in table.rows.items():
        printed = [x for line in figures()[names[phi]]["value"] for x in line]
        assert [s.value for s in row.values()] == printed


def test_every_published_figure_has_its_sentence():
    assert len(figures()) == 220
    assert all(f["quote"] and f["kind"] in ("lab", "fea", "prb", "spec", "analytic") for f in figures().values())


def test_a_missing_lab_file_is_named(tmp_path):
    with pytest.raises(ValueError, match=r"lab file 'mine.csv' not found .* shipped: published:table_5_1"):
        locate("mine.csv", tmp_path)


HEADER = (
    "phi [deg],k_yy [N/mm],k_yz [N/m],m_yx [N/rad],k_zy [N/m],k_zz [N/m],m_zx [N/rad],t_xy [N],t_xz [N],n_xx [N*m/rad]"
)


def write(path, *rows, header=HEADER):
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    return path


def test_own_tables_may_use_other_units(tmp_path):
    table = read_stiffness_table(write(tmp_path / "own.csv", "30,5.5,1,2,3,4,5,6,7,8"))
    assert table.rows[30]["k_yy"].value == pytest.approx(5500.0)


@pytest.mark.parametrize(
    ("rows", "header", "words"),
    [
        (["30,1,2"], HEADER, "own.csv, row 2: 3 cells, 10 columns"),
        (["30,x,1,2,3,4,5,6,7,8"], HEADER, "own.csv, row 2, column k_yy"),
        (["30,1,1,2,3,4,5,6,7,8"] * 2, HEADER, "own.csv, row 3: phi 30 deg stands twice"),
        ([], HEADER.replace("k_zz [N/m]", "k_zz"), "column header 'k_zz' needs its unit"),
        ([], HEADER.replace("k_zz", "k_xx"), "column 'k_zz' is missing"),
        (
            ["30,1,1,2,3,4,5,6,7,8"],
            HEADER.replace("k_zz [N/m]", "k_zz [s]"),
            "row 2, column k_zz: .* has the unit second",
        ),
    ],
)
def test_faults_are_named_by_file_row_and_column(tmp_path, rows, header, words):
    with pytest.raises(ValueError, match=words):
        read_stiffness_table(write(tmp_path / "own.csv", *rows, header=header))
