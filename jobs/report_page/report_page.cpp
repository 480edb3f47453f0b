// SPDX-License-Identifier: MIT
#include "jobs/report_page/report_page.h"

#include <filesystem>

#include "io/file/atomic_file.h"
#include "jobs/report_page/report_text.h"

namespace rattan {

ReportTotals write_batch_report(const std::string& directory, std::span<const BatchItem> items) {
  const BatchReport report = read_batch_report(directory, items);
  const auto write = [&](const char* name, const auto& text) {
    AtomicFile file((std::filesystem::path(directory) / name).string());
    text(report, [&](std::string_view piece) { file.write(piece); });
    file.commit();
  };
  write("report.json", write_report_json);
  write("report.html", write_report_html);
  return report.totals;
}

}  // namespace rattan
