// SPDX-License-Identifier: MIT
#include "engine/layout/base_complex.h"

#include <algorithm>
#include <array>
#include <utility>

#include "engine/core/errors.h"

namespace rattan {

namespace {

class Builder {
 public:
  Builder(const ChartLayout& layout, const FlatLayout& flat) : g_(layout.graph), flat_(flat) {}

  PolygonMesh run() {
    const std::uint64_t rim = g_.node_position.size() + g_.division_begin.back();
    ensure(rim + 8 * std::uint64_t{g_.ring_darts.size()} < 0xffffffffU,
           "the base complex fits 32-bit numbers");
    out_.positions = g_.node_position;
    out_.positions.insert(out_.positions.end(), flat_.division_position.begin(),
                          flat_.division_position.end());
    std::vector<std::uint32_t> ring;
    for (std::uint32_t c = 0; c < g_.chart_count(); ++c) {
      list_ring(c, ring);
      if (g_.units == 1) {
        out_.add_face(ring);
        continue;
      }
      if (meets_itself(c)) {
        inset(c, ring);
      }
      fan(ring, flat_.centre[c]);
    }
    return std::move(out_);
  }

 private:
  /// Vertices around the chart: corners and, with units 2, the middles of sides between them.
  void list_ring(std::uint32_t chart, std::vector<std::uint32_t>& ring) const {
    ring.clear();
    for (const std::uint32_t dart : g_.ring(chart)) {
      const ChartStrand& s = g_.strands[dart >> 1];
      const std::uint32_t steps = s.parts * g_.units;
      const auto first =
          static_cast<std::uint32_t>(g_.node_position.size() + g_.division_begin[dart >> 1]);
      for (std::uint32_t i = 0; i < steps; ++i) {
        const std::uint32_t along = (dart & 1U) == 0 ? i : steps - i;
        if (s.closed()) {
          ring.push_back(first + along % steps);
        } else {
          ring.push_back(along == 0 ? s.node[0] : along == steps ? s.node[1] : first + along - 1);
        }
      }
    }
  }

  bool meets_itself(std::uint32_t chart) const {
    const auto ring = g_.ring(chart);
    return std::any_of(ring.begin(), ring.end(), [&](std::uint32_t d) {
      return g_.strands[d >> 1].chart[0] == g_.strands[d >> 1].chart[1];
    });
  }

  std::uint32_t add(const Vec3d& position) {
    out_.positions.push_back(position);
    return static_cast<std::uint32_t>(out_.positions.size() - 1);
  }

  void inset(std::uint32_t chart, std::vector<std::uint32_t>& ring) {
    std::vector<std::uint32_t> inner;
    inner.reserve(ring.size());
    for (const std::uint32_t v : ring) {
      inner.push_back(add(0.5 * (out_.positions[v] + flat_.centre[chart])));
    }
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const std::size_t j = (i + 1) % ring.size();
      out_.add_face(std::array{ring[i], ring[j], inner[j], inner[i]});
    }
    ring = std::move(inner);
  }

  void fan(const std::vector<std::uint32_t>& ring, const Vec3d& position) {
    const std::uint32_t centre = add(position);
    for (std::size_t i = 0; i < ring.size(); i += 2) {
      const std::uint32_t before = ring[(i + ring.size() - 1) % ring.size()];
      out_.add_face(std::array{ring[i], ring[i + 1], centre, before});
    }
  }

  const ChartGraph& g_;
  const FlatLayout& flat_;
  PolygonMesh out_;
};

}  // namespace

PolygonMesh base_complex(const ChartLayout& layout, const FlatLayout& flat) {
  return Builder(layout, flat).run();
}

}  // namespace rattan
