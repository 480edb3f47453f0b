// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cerrno>
#include <charconv>
#include <dirent.h>
#include <fcntl.h>
#include <memory>
#include <sys/stat.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "jobs/batch/journal.h"
#include "jobs/batch/name_text.h"

namespace rattan {

namespace {

constexpr std::size_t kReadBytes = std::size_t{1} << 18;

enum class Name {
  kOther,
  kEvent,
  kTime,
  kId,
  kIdHex,
  kScan,
  kScanHex,
  kScanBytes,
  kScanTime,
  kKey,
  kOptions,
  kAttempt,
  kHost,
  kPid,
  kSlurm,
  kThreads,
  kMemory,
  kCost,
  kTriangles,
  kRattan,
  kExit,
  kSentence,
  kSeconds,
  kCpuSeconds,
  kPeak,
  kOutputs,
  kPath,
  kPathHex,
  kBytes,
  kWarnings,
  kAdopted,
  kAction,
  kItems,
  kTotal,
  kShard,
  kShards,
};

struct Named {
  std::string_view text;
  Name name;
};

Name name_of(std::string_view text) {
  static constexpr Named kNames[] = {{"event", Name::kEvent},
                                     {"time", Name::kTime},
                                     {"id", Name::kId},
                                     {"id_hex", Name::kIdHex},
                                     {"scan_hex", Name::kScanHex},
                                     {"path_hex", Name::kPathHex},
                                     {"scan", Name::kScan},
                                     {"scan_bytes", Name::kScanBytes},
                                     {"scan_time", Name::kScanTime},
                                     {"key", Name::kKey},
                                     {"options", Name::kOptions},
                                     {"attempt", Name::kAttempt},
                                     {"host", Name::kHost},
                                     {"pid", Name::kPid},
                                     {"slurm", Name::kSlurm},
                                     {"threads", Name::kThreads},
                                     {"memory", Name::kMemory},
                                     {"cost", Name::kCost},
                                     {"triangles", Name::kTriangles},
                                     {"rattan", Name::kRattan},
                                     {"exit", Name::kExit},
                                     {"sentence", Name::kSentence},
                                     {"seconds", Name::kSeconds},
                                     {"cpu_seconds", Name::kCpuSeconds},
                                     {"peak_rss_bytes", Name::kPeak},
                                     {"outputs", Name::kOutputs},
                                     {"path", Name::kPath},
                                     {"bytes", Name::kBytes},
                                     {"warnings", Name::kWarnings},
                                     {"adopted", Name::kAdopted},
                                     {"action", Name::kAction},
                                     {"items", Name::kItems},
                                     {"total", Name::kTotal},
                                     {"shard", Name::kShard},
                                     {"shards", Name::kShards}};
  for (const Named& n : kNames) {
    if (n.text == text) {
      return n.name;
    }
  }
  return Name::kOther;
}

/// A record from the events of a parser, without a tree of it: a journal may have millions.
class RecordParser {
 public:
  // NOLINTBEGIN(readability-identifier-naming): names that the parser looks for
  using number_integer_t = nlohmann::json::number_integer_t;
  using number_unsigned_t = nlohmann::json::number_unsigned_t;
  using number_float_t = nlohmann::json::number_float_t;
  using string_t = nlohmann::json::string_t;
  using binary_t = nlohmann::json::binary_t;
  // NOLINTEND(readability-identifier-naming)

  bool parse(std::string_view line) {
    start_ = {};
    end_ = {};
    batch_ = {};
    event_.clear();
    depth_ = 0;
    return nlohmann::json::sax_parse(line.begin(), line.end(), this) && depth_ == 0;
  }
  /// True for a whole record, which the visitor has got then.
  bool hand_to(JournalVisitor& visitor) {
    if (event_ == "start" && !start_.id.empty()) {
      visitor.visit(start_);
    } else if (event_ == "end" && !start_.id.empty()) {
      end_.time = start_.time;
      end_.id.swap(start_.id);
      end_.attempt = start_.attempt;
      end_.host.swap(start_.host);
      end_.pid = start_.pid;
      end_.exit = batch_.exit;
      end_.seconds = batch_.seconds;
      end_.cpu_seconds = batch_.cpu_seconds;
      visitor.visit(end_);
    } else if (event_ == "batch") {
      batch_.time = start_.time;
      batch_.host.swap(start_.host);
      batch_.pid = start_.pid;
      batch_.slurm.swap(start_.slurm);
      batch_.threads = start_.threads;
      batch_.memory = start_.memory;
      batch_.cost = start_.cost;
      visitor.visit(batch_);
    } else {
      return false;
    }
    return true;
  }
  bool says_end_of_batch() const { return event_ == "batch" && batch_.action == "end"; }

  bool null() { return true; }
  bool boolean(bool value) {
    if (name_ == Name::kAdopted) {
      end_.adopted = value;
    }
    return true;
  }
  bool number_integer(number_integer_t value) {
    if (name_ == Name::kScanTime && depth_ == 1) {
      start_.scan_time = value;
      return true;
    }
    return number_float(static_cast<double>(value), {});
  }
  bool number_unsigned(number_unsigned_t value) {
    switch (name_) {
      case Name::kScanBytes:
        start_.scan_bytes = value;
        return true;
      case Name::kScanTime:
        start_.scan_time = static_cast<std::int64_t>(value);
        return true;
      case Name::kMemory:
        start_.memory = value;
        return true;
      case Name::kPeak:
        end_.peak_rss_bytes = value;
        return true;
      case Name::kBytes:
        if (!end_.outputs.empty()) {
          end_.outputs.back().bytes = value;
        }
        return true;
      default:
        return number_float(static_cast<double>(value), {});
    }
  }
  bool number_float(number_float_t value, const string_t& /*text*/) {
    // Nothing that is counted here comes near the limits.
    const double bounded = std::clamp(value, -1e9, 4e9);
    switch (name_) {
      case Name::kTime:
        start_.time = value;
        break;
      case Name::kAttempt:
        start_.attempt = static_cast<int>(std::clamp(value, 0.0, 1e9));
        break;
      case Name::kPid:
        start_.pid = static_cast<int>(std::clamp(value, 0.0, 1e9));
        break;
      case Name::kThreads:
        start_.threads = static_cast<int>(std::clamp(value, 0.0, 1e9));
        break;
      case Name::kCost:
        start_.cost = value;
        break;
      case Name::kTriangles:
        start_.triangles = value;
        break;
      case Name::kExit:
        batch_.exit = static_cast<int>(std::clamp(value, -1e9, 1e9));
        break;
      case Name::kSeconds:
        batch_.seconds = value;
        break;
      case Name::kCpuSeconds:
        batch_.cpu_seconds = value;
        break;
      case Name::kWarnings:
        end_.warnings = static_cast<std::uint64_t>(std::max(bounded, 0.0));
        break;
      case Name::kItems:
        batch_.items = static_cast<std::uint64_t>(std::max(bounded, 0.0));
        break;
      case Name::kTotal:
        batch_.total = static_cast<std::uint64_t>(std::max(bounded, 0.0));
        break;
      case Name::kShard:
        batch_.shard = static_cast<std::uint32_t>(std::max(bounded, 0.0));
        break;
      case Name::kShards:
        batch_.shards = static_cast<std::uint32_t>(std::max(bounded, 0.0));
        break;
      default:
        break;
    }
    return true;
  }
  bool string(string_t& value) {
    switch (name_) {
      case Name::kEvent:
        event_.swap(value);
        break;
      case Name::kId:
        start_.id.swap(value);
        break;
      case Name::kIdHex:
        start_.id = from_hex(value);
        break;
      case Name::kScan:
        start_.scan.swap(value);
        break;
      case Name::kScanHex:
        start_.scan = from_hex(value);
        break;
      case Name::kPathHex:
        if (!end_.outputs.empty()) {
          end_.outputs.back().path = from_hex(value);
        }
        break;
      case Name::kKey:
        start_.key.swap(value);
        break;
      case Name::kOptions:
        start_.options.push_back(value);
        break;
      case Name::kHost:
        start_.host.swap(value);
        break;
      case Name::kSlurm:
        start_.slurm.swap(value);
        break;
      case Name::kRattan:
        start_.rattan.swap(value);
        break;
      case Name::kSentence:
        end_.sentence.swap(value);
        break;
      case Name::kPath:
        if (!end_.outputs.empty()) {
          end_.outputs.back().path.swap(value);
        }
        break;
      case Name::kAction:
        batch_.action.swap(value);
        break;
      default:
        break;
    }
    return true;
  }
  bool binary(binary_t& /*value*/) { return true; }
  bool start_object(std::size_t /*elements*/) {
    if (depth_ > 0 && name_ == Name::kOutputs) {
      end_.outputs.emplace_back();
      inside_outputs_ = true;
    }
    return ++depth_ < 8;
  }
  bool key(string_t& text) {
    name_ = name_of(text);
    return true;
  }
  bool end_object() {
    --depth_;
    if (depth_ > 0 && inside_outputs_) {
      name_ = Name::kOutputs;  // the next of the array
    }
    return true;
  }
  bool start_array(std::size_t /*elements*/) { return ++depth_ < 8; }
  bool end_array() {
    --depth_;
    inside_outputs_ = false;
    name_ = Name::kOther;
    return true;
  }
  bool parse_error(std::size_t /*at*/, const std::string& /*token*/,
                   const nlohmann::detail::exception& /*what*/) {
    return false;
  }

 private:
  StartRecord start_;
  EndRecord end_;
  BatchRecord batch_;
  std::string event_;
  Name name_ = Name::kOther;
  int depth_ = 0;
  bool inside_outputs_ = false;
};

class OpenFile {
 public:
  explicit OpenFile(const std::string& path) : fd_(::open(path.c_str(), O_RDONLY | O_CLOEXEC)) {}
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  ~OpenFile() {
    if (fd_ >= 0) {
      ::close(fd_);
    }
  }
  int get() const { return fd_; }

 private:
  int fd_;
};

}  // namespace

JournalReader::JournalReader(const std::string& directory)
    : folder_(directory + "/.rattan/journal") {}

bool JournalReader::refresh(JournalVisitor& visitor) {
  const std::unique_ptr<DIR, int (*)(DIR*)> folder(::opendir(folder_.c_str()), &::closedir);
  absent_ = folder == nullptr;
  if (absent_) {
    return false;
  }
  std::vector<std::string> fresh;
  while (const dirent* entry = ::readdir(folder.get())) {
    std::string name = entry->d_name;
    if (!name.ends_with(".jsonl")) {
      continue;
    }
    const auto at =
        std::lower_bound(files_.begin(), files_.end(), name,
                         [](const File& f, const std::string& n) { return f.name < n; });
    if (at == files_.end() || at->name != name) {
      fresh.push_back(std::move(name));
    }
  }
  for (std::string& name : fresh) {
    files_.push_back({.name = std::move(name)});
  }
  std::sort(files_.begin(), files_.end(),
            [](const File& a, const File& b) { return a.name < b.name; });
  bool any = false;
  for (File& file : files_) {
    any |= !file.closed && read(file, visitor);
  }
  return any;
}

bool JournalReader::read(File& file, JournalVisitor& visitor) {
  const OpenFile in(folder_ + "/" + file.name);
  struct stat status {};
  if (in.get() < 0 || ::fstat(in.get(), &status) != 0 ||
      static_cast<std::uint64_t>(status.st_size) <= file.offset) {
    return false;
  }
  RecordParser parser;
  bool any = false;
  buffer_.clear();
  std::size_t used = 0;  // of the buffer, bytes that are lines handed out
  for (;;) {
    buffer_.erase(0, used);
    used = 0;
    const std::size_t had = buffer_.size();
    buffer_.resize(had + kReadBytes);
    const ssize_t got =
        ::pread(in.get(), buffer_.data() + had, kReadBytes, static_cast<off_t>(file.offset + had));
    buffer_.resize(had + (got > 0 ? static_cast<std::size_t>(got) : 0));
    if (got < 0 && errno == EINTR) {
      continue;
    }
    if (got <= 0) {
      return any;
    }
    for (std::size_t end = buffer_.find('\n', std::max(had, used)); end != std::string::npos;
         end = buffer_.find('\n', used)) {
      const std::string_view line(buffer_.data() + used, end - used);
      if (parser.parse(line) && parser.hand_to(visitor)) {
        ++records_;
        any = true;
        file.closed = parser.says_end_of_batch();
      }
      used = end + 1;
    }
    file.offset += used;
  }
}

}  // namespace rattan
