// SPDX-License-Identifier: MIT
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <string_view>
#include <unistd.h>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "engine/core/errors.h"
#include "jobs/batch/journal.h"
#include "jobs/batch/name_text.h"

namespace rattan {

namespace {

using Json = nlohmann::ordered_json;

Json text_or_null(const std::string& text) {
  return text.empty() ? Json() : Json(text);
}

// Names of files are any bytes, a text of JSON is not: others are kept in hexadecimal digits too.
void put_name(Json& record, const char* name, const std::string& text) {
  record[name] = text;
  if (!is_utf8(text)) {
    record[std::string(name) + "_hex"] = to_hex(text);
  }
}

std::string line_of(const Json& record) {
  return record.dump(-1, ' ', false, Json::error_handler_t::replace) + '\n';
}

}  // namespace

double unix_seconds() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

std::string this_host() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "unknown";
}

std::string slurm_task() {
  const char* array = std::getenv("SLURM_ARRAY_JOB_ID");
  const char* task = std::getenv("SLURM_ARRAY_TASK_ID");
  if (array != nullptr && task != nullptr) {
    return fmt::format("{}_{}", array, task);
  }
  const char* job = std::getenv("SLURM_JOB_ID");
  return job == nullptr ? "" : job;
}

JournalWriter::JournalWriter(const std::string& directory, Sync when)
    : path_(directory), when_(when) {}

JournalWriter::~JournalWriter() {
  if (fd_ >= 0) {
    ::close(fd_);
  }
}

void JournalWriter::fail(const char* doing) const {
  throw ResourceError(fmt::format(
      "{}: the journal of the batch cannot be {} ({}). Make room there or choose another folder.",
      path_, doing, std::strerror(errno)));
}

void JournalWriter::write(std::string line) {
  if (fd_ < 0) {
    const std::filesystem::path folder = std::filesystem::path(path_) / ".rattan" / "journal";
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    path_ = (folder / fmt::format("{}-{}-{:.6f}.jsonl", this_host(), ::getpid(), unix_seconds()))
                .string();
    fd_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, 0666);
    if (fd_ < 0) {
      fail("created");
    }
  }
  if (torn_) {
    line.insert(line.begin(), '\n');
  }
  std::size_t done = 0;
  while (done < line.size()) {
    const ssize_t put = ::write(fd_, line.data() + done, line.size() - done);
    if (put < 0 && errno == EINTR) {
      continue;
    }
    if (put <= 0) {
      torn_ = torn_ || done > 0;
      fail("written");
    }
    done += static_cast<std::size_t>(put);
  }
  torn_ = false;
  dirty_ = true;
  if (when_ == Sync::kEach) {
    sync();
  }
}

void JournalWriter::sync() {
  if (dirty_ && ::fdatasync(fd_) != 0) {
    fail("synced");
  }
  dirty_ = false;
}

void JournalWriter::append(const StartRecord& r) {
  Json record = {{"event", "start"}, {"time", r.time}};
  put_name(record, "id", r.id);
  put_name(record, "scan", r.scan);
  record.update(Json{{"scan_bytes", r.scan_bytes},
                     {"scan_time", r.scan_time},
                     {"key", r.key},
                     {"options", r.options},
                     {"attempt", r.attempt},
                     {"host", r.host},
                     {"pid", r.pid},
                     {"slurm", text_or_null(r.slurm)},
                     {"threads", r.threads},
                     {"memory", r.memory},
                     {"cost", r.cost},
                     {"triangles", r.triangles},
                     {"rattan", r.rattan}});
  write(line_of(record));
}

void JournalWriter::append(const EndRecord& r) {
  Json record = {{"event", "end"}, {"time", r.time}};
  put_name(record, "id", r.id);
  record.update(Json{{"attempt", r.attempt},
                     {"host", r.host},
                     {"pid", r.pid},
                     {"exit", r.exit},
                     {"sentence", text_or_null(r.sentence)},
                     {"seconds", r.seconds},
                     {"cpu_seconds", r.cpu_seconds},
                     {"peak_rss_bytes", r.peak_rss_bytes},
                     {"outputs", Json::array()},
                     {"warnings", r.warnings}});
  for (const OutputFile& output : r.outputs) {
    Json entry;
    put_name(entry, "path", output.path);
    entry["bytes"] = output.bytes;
    record["outputs"].push_back(std::move(entry));
  }
  if (r.adopted) {
    record["adopted"] = true;
  }
  write(line_of(record));
}

void JournalWriter::append(const BatchRecord& r) {
  Json record = {{"event", "batch"},   {"action", r.action},   {"time", r.time},
                 {"host", r.host},     {"pid", r.pid},         {"slurm", text_or_null(r.slurm)},
                 {"items", r.items},   {"total", r.total},     {"shard", r.shard},
                 {"shards", r.shards}, {"threads", r.threads}, {"memory", r.memory},
                 {"cost", r.cost}};
  if (r.action == "end") {
    record["seconds"] = r.seconds;
    record["cpu_seconds"] = r.cpu_seconds;
    record["exit"] = r.exit;
  }
  write(line_of(record));
}

}  // namespace rattan
