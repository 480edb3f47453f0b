// SPDX-License-Identifier: MIT
#include "engine/layout/flat_layout.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>

#include "engine/core/archive.h"
#include "engine/core/errors.h"
#include "engine/layout/relax.h"

namespace rattan {

template <class A>
void members_of(A& a, FlatChart& c) {
  a(c.chart);
  a(c.kind);
  a(c.number);
  a(c.position);
  a(c.colour);
  a(c.uv_vertex);
  a(c.uv);
  a(c.triangle);
  a(c.part_begin);
  a(c.part_uv_begin);
  a(c.centre);
  a(c.nudged);
  a(c.thin);
}

namespace {

constexpr Field<char> kFlat{"layout/flat"};
constexpr std::uint64_t kUnused = ~std::uint64_t{0};

/// Places around a chart's rim, `units` a side from its first corner on, and its middle.
struct Lattice {
  std::vector<std::uint32_t> rim;  ///< vertices
  Vec3d centre = Vec3d::Zero();
};

Vec3d at(const FlatChart& c, const Vec2d& uv) {
  // The triangle that holds the point, or holds it most nearly.
  double best = -1e300;
  Vec3d place = c.position.front();
  for (const auto& t : c.triangle) {
    const Vec2d& a = c.uv[t[0]];
    const Vec2d u = c.uv[t[1]] - a;
    const Vec2d v = c.uv[t[2]] - a;
    const Vec2d d = uv - a;
    const double det = u.x() * v.y() - u.y() * v.x();
    if (!(det > 0.0)) {
      continue;
    }
    const double x = (d.x() * v.y() - d.y() * v.x()) / det;
    const double y = (u.x() * d.y() - u.y() * d.x()) / det;
    const double inside = std::min({x, y, 1.0 - x - y});
    if (inside > best) {
      best = inside;
      place = (1.0 - x - y) * c.position[c.uv_vertex[t[0]]] + x * c.position[c.uv_vertex[t[1]]] +
              y * c.position[c.uv_vertex[t[2]]];
    }
    if (inside >= 0.0) {
      break;
    }
  }
  return place;
}

Lattice lattice(const FlatChart& c, std::uint32_t sides, std::uint32_t units) {
  Lattice out;
  out.rim.assign(std::size_t{sides} * units, ~0U);
  const auto split = c.kind == ChartKind::kSplit;
  const auto n = static_cast<double>(units);
  for (std::uint32_t p = 0; p + 1 < c.part_uv_begin.size(); ++p) {
    for (std::uint32_t i = c.part_uv_begin[p]; i < c.part_uv_begin[p + 1]; ++i) {
      const Vec2d& x = c.uv[i];
      if (x.x() != std::floor(x.x()) || x.y() != std::floor(x.y())) {
        continue;
      }
      const auto u = static_cast<std::uint32_t>(x.x());
      const auto v = static_cast<std::uint32_t>(x.y());
      if (split) {
        if (v == 0) {
          out.rim[2 * p + u] = c.uv_vertex[i];
        }
      } else if (v == 0) {
        out.rim[u % (4 * units)] = c.uv_vertex[i];
      } else if (u == units) {
        out.rim[units + v] = c.uv_vertex[i];
      } else if (v == units) {
        out.rim[3 * units - u] = c.uv_vertex[i];
      } else if (u == 0) {
        out.rim[4 * units - v] = c.uv_vertex[i];
      }
    }
  }
  for (const std::uint32_t v : out.rim) {
    ensure(v != ~0U, "every division of a chart's rim is a vertex");
  }
  out.centre = split ? c.position[c.centre] : at(c, Vec2d(0.5 * n, 0.5 * n));
  return out;
}

/// Of one tile's charts what goes into FlatLayout.
struct TileFigures {
  struct Division {
    std::uint64_t division = 0;
    bool used = false;
    Vec3d position;
    Rgba colour{};
  };
  FlatCounts counts;
  std::vector<std::uint32_t> parts;
  std::vector<std::uint8_t> kinds;
  std::vector<DistortionTotals> distortion;
  std::vector<Vec3d> centres;
  std::vector<Division> divisions;
  std::uint64_t triangles = 0;
  std::uint64_t texture_vertices = 0;
  std::uint64_t made = 0;
  DistortionSums sums;
};

void add_figures(const FlatChart& c, const ChartGraph& g, double unit, TileFigures& f) {
  const std::uint32_t sides = g.sides(c.chart);
  FlatCounts& n = f.counts;
  ++n.charts;
  n.quads += sides == 4 ? 1 : 0;
  n.unfolded += c.kind == ChartKind::kUnfolded ? 1 : 0;
  n.flattened += c.kind == ChartKind::kFlattened ? 1 : 0;
  n.split += c.kind == ChartKind::kSplit ? 1 : 0;
  n.singular += g.chart_singular[c.chart];
  n.nudged += c.nudged;
  n.thin += c.thin;
  if (c.kind != ChartKind::kUnfolded && g.chart_singular[c.chart] == 0) {
    const auto ring = g.ring(c.chart);
    n.bounded += std::any_of(ring.begin(), ring.end(),
                             [&](std::uint32_t d) { return g.strands[d >> 1].boundary(); })
                     ? 1
                     : 0;
  }
  f.parts.push_back(static_cast<std::uint32_t>(c.part_begin.size() - 1));
  f.kinds.push_back(static_cast<std::uint8_t>(c.kind));
  f.triangles += c.triangle.size();
  f.texture_vertices += c.uv.size();
  f.made += static_cast<std::uint64_t>(std::count(c.number.begin(), c.number.end(), kUnnumbered));
  DistortionTotals totals;
  for (const auto& t : c.triangle) {
    const TriangleDistortion d =
        triangle_distortion({c.position[c.uv_vertex[t[0]]], c.position[c.uv_vertex[t[1]]],
                             c.position[c.uv_vertex[t[2]]]},
                            {unit * c.uv[t[0]], unit * c.uv[t[1]], unit * c.uv[t[2]]});
    totals.add(d);
    f.sums.add(d);
  }
  f.distortion.push_back(totals);

  const Lattice places = lattice(c, sides, g.units);
  f.centres.push_back(places.centre);
  std::uint32_t i = 0;
  for (const std::uint32_t dart : g.ring(c.chart)) {
    const std::uint32_t s = dart >> 1;
    const std::uint32_t steps = g.strands[s].parts * g.units;
    for (std::uint32_t step = 0; step < steps; ++step, ++i) {
      const std::uint32_t along = (dart & 1U) == 0 ? step : steps - step;
      const bool closed = g.strands[s].closed();
      if (!closed && (along == 0 || along == steps)) {
        continue;  // a node
      }
      TileFigures::Division d;
      d.division = g.division_begin[s] + (closed ? along % steps : along - 1);
      const std::uint32_t v = places.rim[i];
      d.used = c.number[v] == g.first_division + d.division;
      d.position = c.position[v];
      d.colour = c.colour.empty() ? Rgba{} : c.colour[v];
      f.divisions.push_back(d);
    }
  }
}

std::vector<FlatChart> unpack_charts(const ChunkBytes& bytes) {
  std::vector<FlatChart> charts;
  unpack({reinterpret_cast<const char*>(bytes->data()), bytes->size()}, charts);
  return charts;
}

void relax_once(Store& store, const ScanMesh& mesh, const ChartLayout& layout,
                StrandRelaxation& relaxation, TaskGraph& tasks) {
  struct State {
    ChartChunks chunks;
    std::vector<StrandWish> wishes;
  };
  const FlattenOptions options{relaxation.given()};
  run_pass<State>(
      tasks, "relax", mesh.layout.tile_count(),
      [&](TileId tile, State& s) { s.chunks = load_pieces(store, layout, tile); },
      [&](TileId tile, State& s) {
        for (ChartMesh& m : assemble_charts(s.chunks, layout, tile, false)) {
          if (relaxation.touches(m.chart)) {
            for (StrandWish& w :
                 rim_wishes(flatten_chart(std::move(m), layout.graph, options), layout.graph)) {
              s.wishes.push_back(std::move(w));
            }
          }
        }
        s.chunks = {};
      },
      [&](TileId, State& s) { relaxation.add(s.wishes); });
  relaxation.end_round();
}

}  // namespace

FlatCounts& FlatCounts::operator+=(const FlatCounts& o) {
  charts += o.charts;
  quads += o.quads;
  unfolded += o.unfolded;
  flattened += o.flattened;
  split += o.split;
  singular += o.singular;
  bounded += o.bounded;
  nudged += o.nudged;
  thin += o.thin;
  return *this;
}

FlatLayout flatten_layout(Store& store, const ScanMesh& mesh, const ChartLayout& layout,
                          double omega, int relax, TaskGraph& tasks, DistortionSums& sums) {
  const ChartGraph& g = layout.graph;
  std::optional<StrandRelaxation> relaxation;
  FlattenOptions options;
  if (relax > 0) {
    relaxation.emplace(g);
    for (int round = 0; round < relax; ++round) {
      relax_once(store, mesh, layout, *relaxation, tasks);
    }
    options.given = relaxation->given();
  }
  FlatLayout out;
  out.unit = omega / g.units;
  out.size.units = g.units;
  out.size.charts = g.chart_count();
  out.size.has_colours = mesh.has_colours;
  out.part_begin.assign(1, 0);
  out.uv_begin.assign(1, 0);
  const auto divisions = static_cast<std::size_t>(g.division_begin.back());
  out.division_number.assign(divisions, kUnused);
  out.division_position.assign(divisions, Vec3d::Zero());
  if (mesh.has_colours) {
    out.division_colour.assign(divisions, Rgba{});
  }
  std::vector<std::uint64_t> made;
  struct State {
    ChartChunks chunks;
    std::string packed;
    TileFigures figures;
  };
  run_pass<State>(
      tasks, "flatten", mesh.layout.tile_count(),
      [&](TileId tile, State& s) { s.chunks = load_pieces(store, layout, tile); },
      [&](TileId tile, State& s) {
        std::vector<ChartMesh> meshes = assemble_charts(s.chunks, layout, tile, mesh.has_colours);
        s.chunks = {};
        std::vector<FlatChart> charts;
        charts.reserve(meshes.size());
        for (ChartMesh& m : meshes) {
          charts.push_back(flatten_chart(std::move(m), g, options));
          m = {};
          add_figures(charts.back(), g, out.unit, s.figures);
        }
        s.packed = pack(charts);
      },
      [&](TileId tile, State& s) {
        write(store, kFlat, tile, std::span<const char>(s.packed));
        TileFigures& f = s.figures;
        out.counts += f.counts;
        for (const std::uint32_t parts : f.parts) {
          out.part_begin.push_back(out.part_begin.back() + parts);
        }
        out.chart_kind.insert(out.chart_kind.end(), f.kinds.begin(), f.kinds.end());
        out.distortion.insert(out.distortion.end(), f.distortion.begin(), f.distortion.end());
        out.centre.insert(out.centre.end(), f.centres.begin(), f.centres.end());
        for (const TileFigures::Division& d : f.divisions) {
          out.division_position[d.division] = d.position;
          if (d.used) {
            out.division_number[d.division] = 0;
          }
          if (mesh.has_colours) {
            out.division_colour[d.division] = d.colour;
          }
        }
        out.uv_begin.push_back(out.uv_begin.back() + f.texture_vertices);
        out.size.triangles += f.triangles;
        made.push_back(f.made);
        sums.merge(f.sums);
      });
  std::uint64_t next = g.first_division;
  for (std::uint64_t& number : out.division_number) {
    number = number == kUnused ? kUnused : next++;
  }
  out.made_begin.assign(1, next);
  for (const std::uint64_t n : made) {
    out.made_begin.push_back(out.made_begin.back() + n);
  }
  out.size.vertices = out.made_begin.back();
  out.size.texture_vertices = out.uv_begin.back();
  out.size.parts = out.part_begin.back();
  return out;
}

std::vector<FlatChart> load_flat_charts(Store& store, TileId tile) {
  return unpack_charts(store.read_chunk(kFlat.name, tile));
}

void StoredLayout::for_each_vertices(const std::function<void(const LayoutVertices&)>& f) {
  const std::uint32_t tiles = mesh_.layout.tile_count();
  std::vector<Vec3d> positions;
  std::vector<Rgba> colours;
  const auto give = [&](std::uint64_t first) {
    if (!positions.empty()) {
      f({first, positions, colours});
    }
    positions.clear();
    colours.clear();
  };
  for (std::uint32_t t = 0; t < tiles; ++t) {
    const TileExtent& e = mesh_.layout.tiles[t];
    const ChunkView<Vec3f> p = read(store_, fields::kPosition, TileId(t));
    for (std::uint32_t i = 0; i < e.owned; ++i) {
      positions.push_back(p[i].cast<double>());
    }
    if (mesh_.has_colours) {
      const ChunkView<Rgba> c = read(store_, fields::kColour, TileId(t));
      colours.assign(c.begin(), c.begin() + e.owned);
    }
    give(e.first);
  }
  for (std::uint32_t t = 0; t < tiles; ++t) {
    for (const LayoutPoint& p : read(store_, fields::kLayoutPoint, TileId(t))) {
      positions.push_back(p.position.cast<double>());
      if (mesh_.has_colours) {
        colours.push_back(p.colour);
      }
    }
    give(layout_.point_begin[t]);
  }
  for (std::size_t d = 0; d < flat_.division_number.size(); ++d) {
    if (flat_.division_number[d] != kUnused) {
      positions.push_back(flat_.division_position[d]);
      if (mesh_.has_colours) {
        colours.push_back(flat_.division_colour[d]);
      }
    }
  }
  give(layout_.graph.first_division);
  for (std::uint32_t t = 0; t < tiles; ++t) {
    if (flat_.made_begin[t] == flat_.made_begin[t + 1]) {
      continue;
    }
    for (const FlatChart& c : load_flat_charts(store_, TileId(t))) {
      for (std::size_t v = 0; v < c.number.size(); ++v) {
        if (c.number[v] == kUnnumbered) {
          positions.push_back(c.position[v]);
          if (mesh_.has_colours) {
            colours.push_back(c.colour[v]);
          }
        }
      }
    }
    give(flat_.made_begin[t]);
  }
}

void StoredLayout::for_each_chart(const std::function<void(const LayoutChart&)>& f) {
  struct State {
    ChunkBytes bytes;
    std::vector<FlatChart> charts;
  };
  std::vector<std::uint64_t> vertex;
  std::vector<Vec3d> position;
  std::vector<Rgba> colour;
  run_pass<State>(
      tasks_, "charts to file", mesh_.layout.tile_count(),
      [&](TileId tile, State& s) { s.bytes = store_.read_chunk(kFlat.name, tile); },
      [&](TileId, State& s) {
        s.charts = unpack_charts(s.bytes);
        s.bytes = {};
      },
      [&](TileId tile, State& s) {
        std::uint64_t first_uv = flat_.uv_begin[tile.value];
        std::uint64_t made = flat_.made_begin[tile.value];
        const std::uint64_t first_division = layout_.graph.first_division;
        for (FlatChart& c : s.charts) {
          for (std::uint64_t& n : c.number) {
            if (n == kUnnumbered) {
              n = made++;
            } else if (n >= first_division) {
              n = flat_.division_number[n - first_division];
            }
          }
          vertex.clear();
          position.clear();
          colour.clear();
          for (const std::uint32_t v : c.uv_vertex) {
            vertex.push_back(c.number[v]);
            position.push_back(c.position[v]);
            if (mesh_.has_colours) {
              colour.push_back(c.colour[v]);
            }
          }
          f({c.chart, c.kind, flat_.part_begin[c.chart], first_uv, vertex, position, colour, c.uv,
             c.triangle, c.part_begin, c.part_uv_begin});
          first_uv += c.uv.size();
        }
      });
}

}  // namespace rattan
