// SPDX-License-Identifier: MIT
#pragma once

// What was tried in a batch's directory, by whoever:
// DIR/.rattan/journal/<host>-<pid>-<start>.jsonl, one file a writing process, one JSON object a
// line. Readers merge all files.

#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

namespace rattan {

struct OutputFile {
  std::string path;  ///< below the batch's directory
  std::uint64_t bytes = 0;
};

/// An attempt at a scan begins.
struct StartRecord {
  double time = 0.0;  ///< seconds since 1970
  std::string id;
  std::string scan;
  std::uint64_t scan_bytes = 0;
  std::int64_t scan_time = 0;
  std::string key;
  std::vector<std::string> options;
  int attempt = 0;  ///< from 1
  std::string host;
  int pid = 0;        ///< of the batch
  std::string slurm;  ///< "<array>_<task>"; empty: null
  int threads = 0;
  std::uint64_t memory = 0;  ///< bytes granted
  double cost = 0.0;         ///< cpu seconds forecast
  double triangles = 0.0;    ///< forecast
  std::string rattan;        ///< version and commit
};

/// It ended.
struct EndRecord {
  double time = 0.0;
  std::string id;
  int attempt = 0;
  std::string host;
  int pid = 0;
  int exit = 0;          ///< class: 0, 1, 2, 3, 4 or 75
  std::string sentence;  ///< of the error; empty when done
  double seconds = 0.0;
  double cpu_seconds = 0.0;
  std::uint64_t peak_rss_bytes = 0;
  std::vector<OutputFile> outputs;
  std::uint64_t warnings = 0;
  /// Found finished after the process that watched over it had died.
  bool adopted = false;
};

/// A batch begins or ends.
struct BatchRecord {
  std::string action;  ///< "begin" or "end"
  double time = 0.0;
  std::string host;
  int pid = 0;
  std::string slurm;
  std::uint64_t items = 0;  ///< of this process
  std::uint64_t total = 0;  ///< of the whole selection, all shards
  std::uint32_t shard = 0;  ///< from 1; 0: no shards
  std::uint32_t shards = 0;
  int threads = 0;
  std::uint64_t memory = 0;
  double cost = 0.0;         ///< cpu seconds forecast of what is to be done
  double cpu_seconds = 0.0;  ///< at the end: of all its processes
  double seconds = 0.0;      ///< at the end: wall time
  int exit = 0;              ///< at the end
};

/// Appends to a file of its own, made with the first record. Not for threads.
class JournalWriter {
 public:
  enum class Sync { kEach, kByHand };
  /// With kEach a record is on the disk when append returns, otherwise when sync() does; processes
  /// of this machine see it at once.
  explicit JournalWriter(const std::string& directory, Sync when = Sync::kEach);
  ~JournalWriter();
  JournalWriter(const JournalWriter&) = delete;
  JournalWriter& operator=(const JournalWriter&) = delete;

  /// Throws ResourceError where the disk is full or the folder can't be written to.
  void append(const StartRecord& record);
  void append(const EndRecord& record);
  void append(const BatchRecord& record);
  void sync();

 private:
  void write(std::string line);
  [[noreturn]] void fail(const char* doing) const;

  std::string path_;
  Sync when_;
  bool dirty_ = false;
  int fd_ = -1;
  bool torn_ = false;  ///< the last write was cut off
};

/// What reads records gets them here, one at a time; the structs are reused.
class JournalVisitor {
 public:
  virtual ~JournalVisitor() = default;
  virtual void visit(const StartRecord&) {}
  virtual void visit(const EndRecord&) {}
  virtual void visit(const BatchRecord&) {}
};

/// Reads all journal files of a directory, each from where it stopped the last time. A torn last
/// line waits for the rest of it; any other line that is no record is passed over.
class JournalReader {
 public:
  /// Reads nothing yet.
  explicit JournalReader(const std::string& directory);

  /// What was appended since the last time. True if there was anything.
  bool refresh(JournalVisitor& visitor);
  std::uint64_t records() const { return records_; }
  /// So far there isn't even a folder for it.
  bool absent() const { return absent_; }

 private:
  struct File {
    std::string name;
    std::uint64_t offset = 0;
    bool closed = false;  ///< its writer said that nothing follows
  };
  bool read(File& file, JournalVisitor& visitor);

  std::string folder_;
  std::vector<File> files_;  ///< by name
  std::string buffer_;
  std::uint64_t records_ = 0;
  bool absent_ = false;
};

/// What the journal says last of a scan. Texts that repeat are kept once; all views live as long as
/// the journal.
struct ScanHistory {
  std::string_view id;
  std::string_view scan;
  std::string_view key;
  std::string_view options;  ///< joined by blanks
  std::string_view host;     ///< of the last attempt
  std::string_view slurm;
  std::string_view sentence;  ///< of the last end
  std::uint64_t scan_bytes = 0;
  std::int64_t scan_time = 0;
  double started = 0.0;  ///< the last start
  double ended = 0.0;    ///< the last end
  double seconds = 0.0;
  double cpu_seconds = 0.0;
  double cost = 0.0;
  double triangles = 0.0;
  std::uint64_t peak_rss_bytes = 0;
  std::uint64_t memory = 0;
  std::uint32_t outputs_at = 0;  ///< see Journal::outputs
  std::uint32_t outputs = 0;
  std::int32_t pid = 0;
  std::int32_t threads = 0;
  std::int32_t attempts = 0;  ///< the last start's number
  std::int32_t ended_attempt = 0;
  std::int32_t exit = -1;  ///< of the last end; -1: none
  std::uint32_t warnings = 0;
  std::string_view rattan;

  /// Begun, and nobody has said how it ended.
  bool open() const { return attempts > ended_attempt; }
};

/// All journals of a directory, merged: attempts at one scan never overlap (see claims.h), so their
/// numbers order them, whatever the clocks of the machines say.
class Journal final : private JournalVisitor {
 public:
  /// Reads nothing yet.
  explicit Journal(const std::string& directory);
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  /// Reads what was appended since the last time. True if there was anything.
  bool refresh() { return reader_.refresh(*this); }
  bool absent() const { return reader_.absent(); }

  /// Null if there is no record of it.
  const ScanHistory* find(std::string_view id) const;
  /// In the order in which they were met first.
  const std::deque<ScanHistory>& scans() const { return scans_; }
  std::vector<OutputFile> outputs(const ScanHistory& scan) const;
  /// In the order of their times.
  std::vector<BatchRecord> batches() const;
  /// Every attempt that ended, in the order of reading: for rates and charts.
  struct Finish {
    double time = 0.0;
    float seconds = 0.0F;
    float cpu_seconds = 0.0F;
    float cost = 0.0F;
    float triangles = 0.0F;
    int exit = 0;
  };
  const std::vector<Finish>& finishes() const { return finishes_; }
  std::uint64_t records() const { return reader_.records(); }

 private:
  void visit(const StartRecord& record) override;
  void visit(const EndRecord& record) override;
  void visit(const BatchRecord& record) override;
  std::string_view keep(std::string_view text);
  ScanHistory& history(std::string_view id);

  JournalReader reader_;
  std::unordered_set<std::string> texts_;
  std::deque<ScanHistory> scans_;
  std::unordered_map<std::string_view, std::uint32_t> index_;
  std::vector<std::pair<std::string_view, std::uint64_t>> outputs_;
  std::vector<BatchRecord> batches_;
  std::vector<Finish> finishes_;
};

/// Seconds since 1970.
double unix_seconds();
/// "<array>_<task>" or "<job>" of the Slurm job that this process runs in; empty outside.
std::string slurm_task();
std::string this_host();

}  // namespace rattan
