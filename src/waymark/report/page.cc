// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/report/page.h"

#include <fmt/format.h>

#include "waymark/base/text.h"
#include "waymark/evaluate/chart.h"

namespace waymark {
namespace {

constexpr std::string_view kStyle = R"(
:root{color-scheme:light;--ink:#1c2733;--soft:#5b6875;--line:#dfe5ea;--blue:#0b62c4;--good:#1a7f37;--check:#9a6700;--bad:#c01c28}
*{box-sizing:border-box}
body{margin:0;background:#f5f7f9;color:var(--ink);font:16px/1.5 system-ui,sans-serif}
main{max-width:1080px;margin:0 auto;padding:20px 16px 48px}
h1{font-size:1.6rem;line-height:1.25;margin:.2em 0;overflow-wrap:anywhere}
h2{font-size:1.15rem;margin:0 0 .6em}
h3{font-size:1rem;margin:1em 0 .3em}
section{background:#fff;border:1px solid var(--line);border-radius:10px;padding:16px;margin:16px 0}
p{margin:.4em 0;overflow-wrap:anywhere}
.note,.lead{color:var(--soft)}
.note{font-size:.88rem}
.badge{display:inline-block;border-radius:99px;padding:0 .7em;color:#fff;font-weight:600;font-size:.9em;white-space:nowrap}
.badge.good{background:var(--good)}.badge.check{background:var(--check)}.badge.bad{background:var(--bad)}
.tip{border-left:4px solid var(--check);padding:.1em .8em;margin:.8em 0}
.side-by-side{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,300px),1fr));gap:16px}
.scroll{overflow-x:auto}
table{border-collapse:collapse;width:100%;font-size:.92rem}
th,td{text-align:left;padding:.35em .8em .35em 0;border-bottom:1px solid var(--line);vertical-align:top;overflow-wrap:break-word}
th{color:var(--soft);font-weight:600}
td:first-child{min-width:6.5em}
code{font-size:.9em;overflow-wrap:anywhere}
figure{margin:0}
figcaption{display:flex;flex-wrap:wrap;justify-content:space-between;gap:0 1em;font-size:.88rem;margin-top:.7em}
figcaption span{color:var(--soft)}
svg{display:block;width:100%;height:auto}
svg text{font:13px system-ui,sans-serif;fill:#5b6875}
.middle{text-anchor:middle}.end{text-anchor:end}
path{fill:none;stroke-linejoin:round}
path.grid{stroke:#e8ecef}.axis{stroke:#8a97a3}
.cloud{stroke:#8aa0b4;stroke-width:2;stroke-linecap:round}
.path0{stroke:#0b62c4;stroke-width:2}.path1{stroke:#c2410c;stroke-width:2}.path2{stroke:#15803d;stroke-width:2}
.path3{stroke:#7e22ce;stroke-width:2}.path4{stroke:#0e7490;stroke-width:2}.path5{stroke:#a16207;stroke-width:2}
.truth{stroke:#8f8f8f;stroke-width:4;opacity:.6}
.error{stroke:#c2410c;stroke-width:1.6}
.start{fill:#fff;stroke:#0b62c4;stroke-width:2}.loop{fill:#7e22ce}.again{fill:#c2410c}
.timeline{position:relative;touch-action:pan-y}
.strip{height:16px;border-radius:3px;background:#eef1f4}
.track{height:64px;background:#f8fafb;border-bottom:1px solid var(--line)}
.track path{vector-effect:non-scaling-stroke}
.l-main{stroke:#0b62c4;stroke-width:1.5}.l-second{stroke:#15803d;stroke-width:1.5}.l-faint{stroke:#a9c4e4;stroke-width:1.5}
.s-tracked{fill:#7cc492;background:#7cc492}.s-filled{fill:#b9dfc4;background:#b9dfc4}.s-initializing{fill:#f0c75e;background:#f0c75e}
.s-lost{fill:#d6404b;background:#d6404b}.s-unreadable{fill:#4b5563;background:#4b5563}.s-dropped{fill:#9ca3af;background:#9ca3af}
.e-loop{fill:#7e22ce;background:#7e22ce}.e-again{fill:#c2410c;background:#c2410c}
.key-line{display:inline-block;width:24px;vertical-align:middle}
.key{white-space:nowrap;margin-left:.8em}.key i{display:inline-block;width:.8em;height:.8em;border-radius:2px;margin-right:.35em}
.axis-x{display:flex;justify-content:space-between;color:var(--soft);font-size:.85rem}
#cursor{position:absolute;top:0;bottom:0;width:1px;background:var(--ink);pointer-events:none}
.facts td{overflow-wrap:anywhere}.times td+td{white-space:nowrap}.facts td:first-child{width:10em;color:var(--soft)}
.bar-box{min-width:4rem}.bar{margin-top:.3em;height:.8em;background:#7fb0e8;border-radius:2px;min-width:1px}
@media(max-width:600px){
main{padding:12px 8px 32px}section{padding:12px}
.stack thead{display:none}.stack tr{display:block;padding:.5em 0;border-bottom:1px solid var(--line)}
.stack td{display:inline-block;border:0;padding:.1em .6em .1em 0;min-width:0}.stack td:first-child{font-weight:600}
.stack td:last-child{display:block;color:var(--soft);font-size:.88rem}}
@media print{body{background:#fff}section{break-inside:avoid}}
)";

constexpr std::string_view kScript = R"(
const data = document.getElementById("timeline-data"), area = document.getElementById("timeline");
if (data && area) {
  const frames = JSON.parse(data.textContent), cursor = document.getElementById("cursor");
  const readout = document.getElementById("readout");
  const figures = [[4, "", " inliers"], [5, "", " features"], [6, "brightness ", ""], [7, "contrast ", ""], [8, "blur ", " %"], [9, "", " ms"]];
  const hint = readout.textContent;
  area.addEventListener("pointerleave", () => {
    cursor.hidden = true;
    readout.textContent = hint;
  });
  area.addEventListener("pointermove", (event) => {
    const box = area.getBoundingClientRect();
    const part = Math.min(Math.max((event.clientX - box.left) / box.width, 0), 1);
    const frame = frames[Math.min(Math.floor(part * frames.length), frames.length - 1)];
    cursor.hidden = false;
    cursor.style.left = `${100 * part}%`;
    const told = figures.filter(([at]) => frame[at] !== null).map(([at, before, after]) => before + frame[at] + after);
    const state = frame[3] ? `${frame[2]} (${frame[3]})` : frame[2];
    readout.textContent = [`Frame ${frame[0]} at ${frame[1]} s: ${state}`, ...told].join(", ");
  });
}
)";

}  // namespace

std::string escaped(std::string_view text) { return escape_xml(printable(text)); }

std::string format_page(std::string_view title, std::string_view body) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src "
      "'unsafe-inline'; script-src 'unsafe-inline'\">\n"
      "<title>{}</title>\n<style>{}</style>\n</head>\n<body>\n<main>\n{}</main>\n"
      "<script>{}</script>\n</body>\n</html>\n",
      escaped(title),
      kStyle,
      body,
      kScript);
}

std::string section(std::string_view heading, std::string_view body) {
  return fmt::format("<section>\n<h2>{}</h2>\n{}</section>\n", escaped(heading), body);
}

std::string badge(Grade grade) {
  return fmt::format("<span class=\"badge {0}\">{0}</span>", to_string(grade));
}

std::string table_of(const std::vector<std::string>& head,
                     const std::vector<std::vector<std::string>>& rows,
                     std::string_view style) {
  const std::string_view shown_style = head.empty() ? "facts" : style;
  std::string html = fmt::format("<div class=\"scroll\"><table class=\"{}\">\n", shown_style);
  if (!head.empty()) {
    html += "<thead><tr>";
    for (const std::string& cell : head) html += "<th scope=\"col\">" + cell + "</th>";
    html += "</tr></thead>\n";
  }
  html += "<tbody>\n";
  for (const std::vector<std::string>& row : rows) {
    html += "<tr>";
    for (const std::string& cell : row) html += "<td>" + cell + "</td>";
    html += "</tr>\n";
  }
  return html + "</tbody></table></div>\n";
}

}  // namespace waymark
