from results.fit_tables import fit_tables

RESULT = {
    "status": "completed",
    "reason": "",
    "parameters": [
        {"name": "E", "unit": "Pa", "lower": 1e6, "upper": 1e9, "value": 48e6, "standard_error": 1e6,
         "interval": [46e6, 50e6]},
        {"name": "tau_t", "unit": "s", "lower": 1e-5, "upper": 0.1, "value": 1e-3, "standard_error": None,
         "interval": [None, None]},
    ],
    "bootstrap": {"names": ["E"], "intervals": [[45e6, 51e6]]},
    "notes": ["a note"],
    "targets": [
        {"name": "release", "use": "held out", "error": 0.031, "rms": 2e-4, "entries": {}, "note": "",
         "nuisances": {"release_time": 2e-3, "offset": [[1e-4, -3e-4, 0.0]]}},
        {"name": "table", "use": "in sample", "error": 0.5, "rms": None, "entries": {"k_yy": -0.3}, "note": "",
         "nuisances": {}},
    ],
}  # fmt: skip


def test_parameters_stand_with_their_intervals_and_records_with_their_use():
    parameters, records = fit_tables({"chain": RESULT})
    assert parameters.rows[0] == ("E", "48 MPa", "1 MPa", "46 MPa to 50 MPa", "45 MPa to 51 MPa", "1 MPa to 1000 MPa")
    assert parameters.rows[1][2:5] == ("-", "-", "")
    assert parameters.notes == ("a note",)
    release, table = records.rows
    assert release[:4] == ("release", "held out", "3.1", "0.2")
    assert release[4] == "release_time 2 ms; offset up to 0.3 mm"
    assert table[3:] == ("-", "", "k_yy -30%")


def test_a_failed_fit_says_why():
    (table,) = fit_tables({"chain": {"status": "failed", "reason": "no reference: x diverged"}})
    assert (table.rows, table.notes) == ((), ("no reference: x diverged",))
