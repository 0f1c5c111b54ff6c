"""Every file of the corpus is refused with the contract's exit status and one sentence that says what is wrong."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from contract import ended

CORPUS = Path(__file__).parent / "corpus"

EXPECTED = {
    "external_storage.h5": (3, "another file"),
    "external_link.h5": (3, "another file"),
    "virtual.h5": (3, "another file"),
    "eleven_gigabytes.h5": (3, "declares"),
    "driver_of_four_gigabytes.h5": (3, "one of several"),
    "metadata_a_list.h5": (3, "write it again|export it again"),
    "metadata_no_json.h5": (3, "export it again"),
    "channels_a_number.h5": (3, "export it again"),
    "name_an_array.h5": (0, ""),
    "truncated.h5": (3, "truncated"),
    "cells_in_cells.mat": (3, "nested deeper"),
    "unpacks_to_forty_megabytes.mat": (3, "unpacks"),
    "cells_that_are_not_there.mat": (3, "cells"),
    "smartshoe_a_number.mat": (3, "export it again"),
    "smartshoe_a_list.mat": (3, "export it again"),
    "smartshoe_no_text_for_a_name.mat": (3, "where a text belongs"),
    "truncated.mat": (3, "truncated"),
    "properties_of_wrong_types.tdms": (3, "export it again"),
    "truncated_header.tdms": (3, "export"),
    "many_values.tdms": (0, ""),  # what is there is read
    "long_names.tdms": (3, "export it again"),
    "odd_type.tdms": (3, "export"),
    "five_thousand_columns.csv": (3, "5001 columns"),
    "beyond_any_number.csv": (3, "line 3.*no measurement"),
    "zeros.csv": (3, "is binary"),
    "time_goes_back.csv": (3, "line 3.*goes back"),
    "no_rows.csv": (3, "no data rows"),
    "two_times.csv": (3, "time_s.*twice"),
    "open_quote.csv": (3, "line"),
    "no_role.csv": (3, "role"),
    "blanks.csv": (3, "is empty"),
    "no_end_of_header.lvm": (3, "header has no end"),
    "a_billion_channels.lvm": (3, "2 column names"),
    "cells_no_numbers.lvm": (3, "'one'.*no number"),
    "no_samples.lvm": (3, "no data|no samples"),
    "bluehill_mixed_marks.csv": (3, "decimal|decimals"),
    "bluehill_no_rows.csv": (3, "no data rows"),
    "no_table.txt": (3, "no table"),
    "calibration_digits.json": (3, "400 digits"),
    "calibration_nothing.json": (3, "is missing|key"),
    "calibration_text.json": (3, "key"),
    "calibration_nan.json": (3, "NaN"),
    "calibration_depth.json": (3, "deep"),
    "name_leads_out.toml": (2, r"key unit\.0\.name"),
    "name_absolute.toml": (2, r"key unit\.0\.name"),
    "name_of_a_device.toml": (2, "device"),
    "protocol_leads_out.toml": (2, "protocol"),
    "unit_under_machine.toml": (2, "machine"),
    "seed_under_unit.toml": (2, "seed"),
    "url_under_machine.toml": (2, "url"),
    "protocol_no_table.toml": (2, "protocol"),
    "repeats_without_bound.toml": (2, "repeats"),
    "years.toml": (2, "lasts"),
    "infinite.toml": (2, "peak_n"),
    "digits.toml": (2, "TOML"),
    "nested.toml": (2, "TOML"),
}
READINGS = "time_s,force_n,pressure_mbar\n" + "".join(f"{0.01 * k!r},{k}.0,{k}.0\n" for k in range(20))


def test_every_file_of_the_corpus_is_expected() -> None:
    assert sorted(path.name for path in CORPUS.iterdir()) == sorted(EXPECTED)


@pytest.mark.parametrize("name", EXPECTED)
@pytest.mark.filterwarnings("default")
def test_a_broken_file_is_refused_in_one_sentence(name: str, tmp_path: Path) -> None:
    status, says = EXPECTED[name]
    source = CORPUS / name
    readings = tmp_path / "readings.csv"
    readings.write_text(READINGS)
    if name.startswith("calibration_"):
        arguments = ["compensate", str(readings), "--calibration", str(source), "--out", str(tmp_path / "out.csv")]
    elif source.suffix == ".toml":
        arguments = ["simulate", str(source), "--out", str(tmp_path)]
    else:
        arguments = ["convert", str(source), str(tmp_path / "out.csv")]
    found = ended(arguments, tmp_path)
    assert found.status == status, found.last_line
    assert re.search(says, found.last_line), found.last_line
