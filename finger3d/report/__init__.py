"""report.html: a self-contained HTML page for each kind of result.

`build.Page` is made of rows, sections and pictures. The modules named like commands fill it from a results
folder alone, so that a page can be written again at any time::

    page = Page(
        "mu from strain",
        headline=[HeadlineRow("resolution of mu", 0.012, error=0.002)],
        sections=[PageSection("Fit", ["second order", Table(head, rows)])],
        figures=[Figure("fit.png", "...")],
        command="calibrate",
    )
    page.write(folder)
"""
