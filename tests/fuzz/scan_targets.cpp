// SPDX-License-Identifier: MIT
#include "tests/fuzz/scan_targets.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <sys/mman.h>
#include <unistd.h>

#include "engine/core/errors.h"
#include "io/scan/scan_parsers.h"
#include "io/scan/scan_reader.h"
#include "tests/io/scan/scan_files.h"

namespace rattan::fuzz {
namespace {

void require(bool kept, const char* promise) {
  if (!kept) {
    std::fprintf(stderr, "broken promise: %s\n", promise);
    std::abort();
  }
}

// A file in memory, under a path that can be opened.
class MemoryFile {
 public:
  MemoryFile() : descriptor_(::memfd_create("scan", MFD_CLOEXEC)) {
    require(descriptor_ >= 0, "a file in memory can be made");
    path_ = "/proc/self/fd/" + std::to_string(descriptor_);
  }
  ~MemoryFile() { ::close(descriptor_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  void rewrite(const std::uint8_t* data, std::size_t size) const {
    require(::ftruncate(descriptor_, 0) == 0, "a file in memory can be emptied");
    std::size_t done = 0;
    while (done < size) {
      const ssize_t wrote =
          ::pwrite(descriptor_, data + done, size - done, static_cast<off_t>(done));
      require(wrote > 0, "a file in memory can be written");
      done += static_cast<std::size_t>(wrote);
    }
  }
  const std::string& path() const { return path_; }

 private:
  int descriptor_;
  std::string path_;
};

struct CheckingSink final : ScanSink {
  explicit CheckingSink(std::uint64_t most) : limit(most) {}

  void add_vertices(std::span<const Vec3d> positions) override {
    require(!positions.empty(), "no block is empty");
    require(colours == 0 || colours == vertices, "every block of vertices has colours, or none");
    vertices += positions.size();
    require(vertices <= limit, "vertices need bytes");
  }
  void add_colours(std::span<const std::array<std::uint8_t, 4>> block) override {
    colours += block.size();
    require(colours == vertices, "each vertex has one colour");
  }
  void add_triangles(std::span<const std::array<std::uint64_t, 3>> block) override {
    triangles += block.size();
    require(triangles <= limit, "triangles need bytes");
    for (const auto& t : block) {
      highest = std::max({highest, t[0], t[1], t[2]});
    }
  }
  void add_polygons(std::span<const std::uint32_t> sizes,
                    std::span<const std::uint64_t> corners) override {
    std::size_t begin = 0;
    for (const std::uint32_t size : sizes) {
      require(size > 3 && size <= corners.size() - begin, "a polygon has its corners");
      for (std::size_t k = begin; k < begin + size; ++k) {
        require(corners[k] >= corners[begin], "a polygon begins at its lowest corner");
        require(corners[k] != corners[k + 1 < begin + size ? k + 1 : begin],
                "a polygon repeats no corner at once");
      }
      begin += size;
    }
    require(begin == corners.size(), "polygons have all corners");
    ScanSink::add_polygons(sizes, corners);
  }

  std::uint64_t limit;
  std::uint64_t vertices = 0;
  std::uint64_t colours = 0;
  std::uint64_t triangles = 0;
  std::uint64_t highest = 0;
};

// Small buffers, so that every record meets the end of one.
constexpr ScanReadOptions kOptions{
    .buffer_bytes = 64, .block_records = 8, .memory_bytes = std::uint64_t{64} << 20};

void read_one(std::string_view target, const std::string& path, ScanSink& sink,
              ScanFileInfo& info) {
  if (target == "gz" || target == "zst" || target == "any") {
    read_scan(path, sink, &info, kOptions);
    return;
  }
  ByteSource source(path, kOptions.buffer_bytes, info);
  ScanBlocks blocks(sink, info, kOptions.block_records);
  if (target == "ply") {
    read_ply(source, blocks, info);
  } else if (target == "obj") {
    read_obj(source, blocks, info);
  } else if (target == "stl") {
    read_stl(source, blocks, info);
  } else if (target == "off") {
    read_off(source, blocks, info);
  } else {
    read_draco(source, blocks, info, kOptions.memory_bytes);
  }
  blocks.flush();
  source.drain();
}

}  // namespace

std::vector<std::string> scan_targets() {
  return {"ply", "obj", "stl", "off", "drc", "gz", "zst", "any"};
}

bool read_bytes_as(std::string_view target, const std::uint8_t* data, std::size_t size) {
  static const MemoryFile file;
  file.rewrite(data, size);
  const bool dense = target == "drc" || target == "gz" || target == "zst" || target == "any";
  CheckingSink sink(dense ? std::numeric_limits<std::uint64_t>::max()
                          : std::max<std::uint64_t>(size, 1));
  ScanFileInfo info;
  try {
    read_one(target, file.path(), sink, info);
  } catch (const InputError&) {
    return false;
  } catch (const ResourceError&) {
    return false;
  }
  require(sink.triangles == 0 || sink.highest < sink.vertices, "indices are in range");
  return true;
}

std::vector<std::string> seeds_of(std::string_view target) {
  using namespace testing;
  const std::vector<std::string> ply = {
      ascii_ply(),
      plain_binary_ply(false),
      plain_binary_ply(true),
      coloured_ply(),
      rich_binary_ply<double, std::uint64_t>(true, "double", "uint64"),
      rich_binary_ply<float, std::uint32_t>(false, "float", "uint")};
  if (target == "ply") {
    return ply;
  }
  if (target == "obj") {
    return {obj(), obj("\r\n")};
  }
  if (target == "stl") {
    return {ascii_stl(), binary_stl("solid but binary"), binary_stl("")};
  }
  if (target == "off") {
    return {off(), coloured_off()};
  }
  if (target == "drc") {
    return {draco_file({}), draco_file({.sequential = true}),
            draco_file({.speed = 0, .colours = true})};
  }
  if (target == "gz") {
    return {gzipped(ascii_ply()), gzipped(obj()) + gzipped("\n")};
  }
  if (target == "zst") {
    return {zstd_compressed(ascii_ply()), zstd_compressed(off())};
  }
  std::vector<std::string> all = ply;
  for (const std::string& other : {obj(), ascii_stl(), binary_stl("solid"), off(), draco_file({}),
                                   gzipped(obj()), zstd_compressed(off())}) {
    all.push_back(other);
  }
  return all;
}

}  // namespace rattan::fuzz
