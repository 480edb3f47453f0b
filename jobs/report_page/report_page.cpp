// SPDX-License-Identifier: MIT
#include "jobs/report_page/report_page.h"

#include <fcntl.h>
#include <filesystem>
#include <sys/file.h>
#include <unistd.h>

#include "io/file/atomic_file.h"
#include "jobs/report_page/report_text.h"

namespace rattan {
namespace {

/// Processes that end together write one after another, the last of them all there is to tell.
class Turn {
 public:
  explicit Turn(const std::string& directory) {
    const auto file = std::filesystem::path(directory) / ".rattan" / "report.lock";
    fd_ = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (fd_ >= 0) {
      static_cast<void>(::flock(fd_, LOCK_EX));
    }
  }
  ~Turn() {
    if (fd_ >= 0) {
      ::close(fd_);
    }
  }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;

 private:
  int fd_ = -1;
};

}  // namespace

ReportTotals write_batch_report(const std::string& directory, std::span<const BatchItem> items) {
  const Turn turn(directory);
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
