// SPDX-License-Identifier: MIT
#pragma once

// One scan of a batch: where it is, what is asked for it, and where its remesh goes.

#include <cstdint>
#include <memory>
#include <string>
#include <sys/stat.h>
#include <vector>

#include "jobs/remesh_options.h"

namespace rattan {

/// Size and time of a file, taken once when the batch is put together; both 0 for one that can't be
/// read, which is found out when its turn comes.
struct FileStamp {
  std::uint64_t bytes = 0;
  std::int64_t time = 0;  ///< of the last change, nanoseconds since 1970

  static FileStamp of(const std::string& path);
  static FileStamp of(const struct stat& status);
  bool operator==(const FileStamp&) const = default;
};

/// What is asked of a scan. Scans with the same options share one of these: a batch may have
/// hundreds of thousands of them.
struct ItemOptions {
  /// Words for `rattan remesh` besides the scan and -o, in a fixed order, without those that say
  /// what is the default anyway; paths in them are absolute.
  std::vector<std::string> words;
  /// What decides the bytes of the outputs besides the scan, as text: see item_key().
  std::string key;
  /// What `words` says; scan and output are empty, memory and threads 0 unless a manifest states
  /// them for this scan.
  RemeshOptions remesh;
};

/// One scan of a batch.
struct BatchItem {
  /// Path of the output below the batch's folder, with '/': unique in the batch. With several sizes
  /// the template that `rattan remesh -o` takes.
  std::string id;
  std::string scan;                         ///< absolute path
  std::shared_ptr<const ItemOptions> what;  ///< never null
  std::uint64_t scan_bytes = 0;             ///< size of the file
  std::int64_t scan_time = 0;               ///< of its last change, nanoseconds since 1970
  /// Processor seconds as stated in a manifest; 0: to be predicted.
  double cost = 0.0;
};

/// The key of an item: the options that decide the bytes, for each size, the stamp of the file of
/// directions, and whether there is to be a preview. Says nothing of where files lie.
std::string item_key(const RemeshOptions& options);

/// Paths of the outputs below the batch's folder, one a size.
std::vector<std::string> item_outputs(const BatchItem& item);

}  // namespace rattan
