// SPDX-License-Identifier: MIT
#include "engine/core/task_graph.h"

#include <atomic>
#include <exception>
#include <utility>

#include <oneapi/tbb/flow_graph.h>
#include <oneapi/tbb/task_arena.h>

#include "engine/core/errors.h"
#include "engine/core/hand_over.h"

namespace rattan {

namespace {

namespace flow = oneapi::tbb::flow;

struct InFlight {
  std::size_t index = 0;
  std::unique_ptr<TileTask> task;
  std::exception_ptr error;
  HandOver handed;  ///< from node to node
};

using Message = std::shared_ptr<InFlight>;

}  // namespace

TaskGraph::TaskGraph(TaskGraphOptions options, ProgressSink* progress, std::stop_token stop,
                     Steps* steps)
    : options_(options), progress_(progress), stop_(std::move(stop)), steps_(steps) {
  if (options_.threads <= 0) {
    options_.threads = oneapi::tbb::this_task_arena::max_concurrency();
  }
  if (options_.tiles_in_flight <= 0) {
    options_.tiles_in_flight = 2 * options_.threads + 2;
  }
}

void TaskGraph::run(std::string_view name, std::uint32_t tile_count,
                    const std::function<std::unique_ptr<TileTask>(TileId)>& make, PassOver over) {
  passes_ += over == PassOver::kScan ? 1 : 0;
  std::atomic<bool> abandon{false};
  std::exception_ptr first_error;
  const auto guarded = [&](Message& m, auto&& step) {
    if (abandon.load(std::memory_order_relaxed) || m->error) {
      return;
    }
    try {
      step(*m->task);
    } catch (...) {
      m->error = std::current_exception();
    }
  };

  // What the graph promises: one body of a serial node after the other, everything after the call
  // and before the return.
  HandOver begun;
  HandOver ended;
  HandOver made;
  HandOver loaded;
  HandOver committed;
  begun.give();

  flow::graph g;
  std::uint32_t next = 0;
  flow::input_node<Message> source(g, [&](oneapi::tbb::flow_control& control) -> Message {
    begun.take();
    made.take();
    if (next == tile_count || abandon.load(std::memory_order_relaxed) || stop_.stop_requested()) {
      control.stop();
      ended.give();
      return {};
    }
    auto m = std::make_shared<InFlight>();
    m->index = next;
    try {
      m->task = make(TileId(next));
    } catch (...) {
      m->error = std::current_exception();
    }
    ++next;
    m->handed.give();
    made.give();
    return m;
  });
  flow::limiter_node<Message> tokens(g, static_cast<std::size_t>(options_.tiles_in_flight));
  flow::function_node<Message, Message> loader(g, flow::serial, [&](Message m) {
    m->handed.take();
    loaded.take();
    guarded(m, [](TileTask& t) { t.load(); });
    loaded.give();
    m->handed.give();
    return m;
  });
  flow::function_node<Message, Message> computer(g, static_cast<std::size_t>(options_.threads),
                                                 [&](Message m) {
                                                   m->handed.take();
                                                   guarded(m, [](TileTask& t) { t.compute(); });
                                                   m->handed.give();
                                                   return m;
                                                 });
  flow::sequencer_node<Message> in_order(g, [](const Message& m) { return m->index; });
  flow::function_node<Message, flow::continue_msg> committer(g, flow::serial, [&](Message m) {
    m->handed.take();
    committed.take();
    guarded(m, [](TileTask& t) { t.commit(); });
    if (m->error && !first_error) {
      first_error = m->error;
      abandon = true;
    }
    m->task.reset();
    if (progress_ != nullptr && !first_error) {
      progress_->progress(name, m->index + 1, tile_count);
    }
    committed.give();
    ended.give();
    return flow::continue_msg();
  });
  flow::make_edge(source, tokens);
  flow::make_edge(tokens, loader);
  flow::make_edge(loader, computer);
  flow::make_edge(computer, in_order);
  flow::make_edge(in_order, committer);
  flow::make_edge(committer, tokens.decrementer());
  source.activate();
  g.wait_for_all();
  ended.take();

  if (first_error) {
    std::rethrow_exception(first_error);
  }
  if (stop_.stop_requested() && next < tile_count) {
    throw Cancelled("Interrupted during " + std::string(name) + ".");
  }
}

}  // namespace rattan
