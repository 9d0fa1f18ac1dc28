"""The results described as an RO-Crate."""

from damper.report.crate import crate

ABOUT = {
    "name": "one",
    "title": "A study",
    "description": "",
    "figures": [("one/figures/map", "map", "A map", "Look here.")],
}
FILES = [
    "claims.md",
    "one/cube.nc",
    "one/quake.csv",
    "one/figures/map.svg",
    "one/study.yaml",
    "one/timed/t.csv",
]


def test_everything_is_described_and_every_link_leads_somewhere(tmp_path):
    for path in FILES:
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text("x")
    made = crate(tmp_path, [ABOUT], FILES, {"damper": "1.0"})
    graph = {entity["@id"]: entity for entity in made["@graph"]}
    assert len(graph) == len(made["@graph"])
    assert graph["ro-crate-metadata.json"]["about"] == {"@id": "./"}
    parts = {part["@id"] for part in graph["./"]["hasPart"] + graph["one/"]["hasPart"]}
    assert parts == {"one/", *FILES}
    links = [
        link["@id"]
        for entity in graph.values()
        for value in entity.values()
        for link in (value if isinstance(value, list) else [value])
        if isinstance(link, dict)
    ]
    assert {link for link in links if not link.startswith("https:")} <= graph.keys()
    assert graph["one/figures/map.svg"]["description"] == "A map. Look here."
    assert graph["one/cube.nc"]["encodingFormat"] == "application/x-netcdf"
    given = [{"@id": "one/quake.csv"}, {"@id": "one/study.yaml"}]
    assert graph["#run"]["object"] == given
    # What holds times is another file after each run.
    (tmp_path / "one/timed/t.csv").write_text("other")
    assert crate(tmp_path, [ABOUT], FILES, {"damper": "1.0"}) == made
    (tmp_path / "one/cube.nc").write_text("other")
    assert crate(tmp_path, [ABOUT], FILES, {"damper": "1.0"}) != made
