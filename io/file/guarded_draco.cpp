// SPDX-License-Identifier: MIT
#include "io/file/guarded_draco.h"

#include <exception>
#include <new>

#include <draco/compression/config/decoder_options.h>
#include <draco/compression/mesh/mesh_edgebreaker_decoder.h>
#include <draco/compression/mesh/mesh_sequential_decoder.h>
#include <draco/core/varint_decoding.h>
#include <draco/mesh/mesh.h>

#include "engine/core/errors.h"

namespace rattan {
namespace {

constexpr const char* kRepair = "Give a whole Draco mesh file; export it again";

// A flat and regular grid, about the best that Draco can meet, has 19 faces to the byte.
constexpr std::uint64_t kMaxFacesPerByte = 64;
constexpr std::uint64_t kFacesOfAnyFile = 4096;

// Bytes that the decoder holds at its peak, measured (edgebreaker, version 1.5.5).
constexpr std::uint64_t kBytesPerFace = 80;
constexpr std::uint64_t kBytesPerFaceAndSeam = 28;
constexpr std::uint64_t kBytesPerPoint = 16;

/// What a file asks for, against what it may have.
class Guard {
 public:
  Guard(const std::string& path, std::uint64_t file_bytes, std::uint64_t memory_bytes)
      : path_(path), file_bytes_(file_bytes), memory_bytes_(memory_bytes) {}

  void check_counts(std::uint64_t faces, std::uint64_t vertices, std::uint64_t seams) {
    const std::uint64_t most = kFacesOfAnyFile + file_bytes_ * kMaxFacesPerByte;
    if (faces > most || vertices > most) {
      throw InputError(path_, "",
                       "it declares " + std::to_string(faces) + " triangles and " +
                           std::to_string(vertices) + " vertices in " +
                           std::to_string(file_bytes_) + " bytes, which cannot be",
                       kRepair);
    }
    need(file_bytes_ + faces * (kBytesPerFace + seams * kBytesPerFaceAndSeam) +
         vertices * kBytesPerPoint);
  }

  void check_attributes(const draco::PointCloud& cloud) {
    const std::uint64_t points = cloud.num_points();
    std::uint64_t bytes = kBytesPerPoint;
    for (std::int32_t a = 0; a < cloud.num_attributes(); ++a) {
      const draco::PointAttribute& attribute = *cloud.attribute(a);
      // The values, those before dequantisation and prediction, and two maps.
      bytes += static_cast<std::uint64_t>(attribute.byte_stride()) +
               std::uint64_t{8} * static_cast<std::uint64_t>(attribute.num_components()) + 12;
    }
    need(needed_ + points * bytes);
  }

 private:
  void need(std::uint64_t bytes) {
    needed_ = bytes;
    if (bytes > memory_bytes_) {
      throw ResourceError(path_ + ": decoding this Draco file takes about " +
                          std::to_string((bytes >> 20) + 1) + " MiB, but only " +
                          std::to_string(memory_bytes_ >> 20) +
                          " MiB are allowed for it. Raise --memory, or convert the scan to PLY, "
                          "which is read as a stream.");
    }
  }

  const std::string& path_;
  std::uint64_t file_bytes_;
  std::uint64_t memory_bytes_;
  std::uint64_t needed_ = 0;
};

/// Reads counts at the decoder's place in the file without moving it.
class Peek {
 public:
  Peek(draco::PointCloudDecoder& decoder, std::uint16_t first_with_varints)
      : buffer_(*decoder.buffer()), fixed_(decoder.bitstream_version() < first_with_varints) {}
  std::uint64_t count() {
    std::uint32_t value = 0;
    if (fixed_) {
      buffer_.Decode(&value);
    } else {
      draco::DecodeVarint(&value, &buffer_);
    }
    return value;
  }
  std::uint64_t byte() {
    std::uint8_t value = 0;
    buffer_.Decode(&value);
    return value;
  }

 private:
  draco::DecoderBuffer buffer_;
  bool fixed_;
};

class GuardedEdgebreaker final : public draco::MeshEdgebreakerDecoder {
 public:
  explicit GuardedEdgebreaker(Guard& guard) : guard_(guard) {}

 protected:
  bool DecodeConnectivity() override {
    Peek peek(*this, DRACO_BITSTREAM_VERSION(2, 0));
    if (bitstream_version() < DRACO_BITSTREAM_VERSION(2, 2)) {
      peek.count();  // vertices that the traversal adds
    }
    const std::uint64_t vertices = peek.count();
    const std::uint64_t faces = peek.count();
    guard_.check_counts(faces, vertices, peek.byte());
    return MeshEdgebreakerDecoder::DecodeConnectivity();
  }
  bool DecodeAllAttributes() override {
    guard_.check_attributes(*point_cloud());
    return MeshEdgebreakerDecoder::DecodeAllAttributes();
  }

 private:
  Guard& guard_;
};

class GuardedSequential final : public draco::MeshSequentialDecoder {
 public:
  explicit GuardedSequential(Guard& guard) : guard_(guard) {}

 protected:
  bool DecodeConnectivity() override {
    Peek peek(*this, DRACO_BITSTREAM_VERSION(2, 2));
    const std::uint64_t faces = peek.count();
    guard_.check_counts(faces, peek.count(), 0);
    return MeshSequentialDecoder::DecodeConnectivity();
  }
  bool DecodeAllAttributes() override {
    guard_.check_attributes(*point_cloud());
    return MeshSequentialDecoder::DecodeAllAttributes();
  }

 private:
  Guard& guard_;
};

}  // namespace

std::unique_ptr<draco::Mesh> decode_draco_mesh(std::string_view bytes, const std::string& path,
                                               std::uint64_t memory_bytes) {
  const auto refuse = [&](const std::string& problem) {
    return InputError(path, "", problem, kRepair);
  };
  draco::DecoderBuffer buffer;
  buffer.Init(bytes.data(), bytes.size());
  draco::DracoHeader header;
  draco::DecoderBuffer ahead = buffer;
  if (!draco::PointCloudDecoder::DecodeHeader(&ahead, &header).ok()) {
    throw refuse("it ends inside the header of a Draco file or has none");
  }
  if (header.encoder_type >= draco::NUM_ENCODED_GEOMETRY_TYPES) {
    throw refuse("the Draco header says a kind of geometry that there is none of");
  }
  if (header.encoder_type != draco::TRIANGULAR_MESH) {
    throw InputError(path, "", "it holds a point cloud, not triangles",
                     "Reconstruct a triangle mesh from it first");
  }
  Guard guard(path, bytes.size(), memory_bytes);
  auto mesh = std::make_unique<draco::Mesh>();
  const draco::DecoderOptions options;
  const auto decode = [&](auto&& decoder) {
    const draco::Status status = decoder.Decode(options, &buffer, mesh.get());
    if (!status.ok()) {
      const std::string& why = status.error_msg_string();
      throw refuse("Draco cannot decode it" + (why.empty() ? "" : " (" + why + ")"));
    }
  };
  try {
    if (header.encoder_method == draco::MESH_EDGEBREAKER_ENCODING) {
      decode(GuardedEdgebreaker(guard));
    } else if (header.encoder_method == draco::MESH_SEQUENTIAL_ENCODING) {
      decode(GuardedSequential(guard));
    } else {
      throw refuse("it is encoded in a way that Draco does not know");
    }
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw refuse("Draco asks for more memory than there is, so it is damaged or too large");
  } catch (const std::exception& error) {  // of a container that was asked for the impossible
    throw refuse(std::string("it is damaged (") + error.what() + ")");
  }
  return mesh;
}

bool holds_numbers(const draco::PointAttribute& attribute) {
  return attribute.data_type() >= draco::DT_INT8 && attribute.data_type() <= draco::DT_FLOAT64;
}

}  // namespace rattan
