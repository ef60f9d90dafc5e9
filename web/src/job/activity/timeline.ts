/** Tasks by worker as bars over time; overlapping tasks of a machine go to separate lanes. */

import type { Activity } from '../../api/types'

type Task = Activity['tasks'][number]

export interface Bar {
  readonly task: Task
  /** Time since the first task shown [s]. */
  readonly start: number
  readonly end: number
  /** Share of the time that the worker computed, 0 to 1. */
  readonly computed: number
}

export type Lane = readonly Bar[]

interface WorkerLanes {
  readonly worker: string
  readonly lanes: readonly Lane[]
}

export interface Timeline {
  readonly workers: readonly WorkerLanes[]
  /** Starts of the iterations, since the first task shown [s]. */
  readonly iterations: readonly { readonly iteration: number; readonly start: number }[]
  readonly seconds: number
}

export function timelineOf({ tasks, iterations }: Activity, most: number): Timeline {
  const shown = tasks.slice(-most).map((task) => ({ task, at: Date.parse(task.begun_at) / 1000 }))
  const first = Math.min(...shown.map(({ at }) => at))
  const bars = shown
    .map(({ task, at }): Bar => {
      const start = at - first
      const computed = task.seconds > 0 ? Math.min(1, task.compute_seconds / task.seconds) : 1
      return { task, start, end: start + task.seconds, computed }
    })
    .sort((a, b) => a.start - b.start)
  const names = [...new Set(bars.map(({ task }) => task.worker))].sort()
  const seconds = Math.max(0, ...bars.map(({ end }) => end))
  return {
    workers: names.map((worker) => ({
      worker,
      lanes: packed(bars.filter(({ task }) => task.worker === worker)),
    })),
    iterations: iterations
      .map(({ iteration, begun_at }) => ({ iteration, start: Date.parse(begun_at) / 1000 - first }))
      .filter(({ start }) => start >= -TOUCH && start <= seconds),
    seconds,
  }
}

const TOUCH = 0.002

/** Put each bar into the first lane that is free when it starts. */
function packed(bars: readonly Bar[]): readonly Lane[] {
  const lanes: Bar[][] = []
  for (const bar of bars) {
    const free = lanes.find((lane) => lane[lane.length - 1].end <= bar.start + TOUCH)
    if (free) free.push(bar)
    else lanes.push([bar])
  }
  return lanes
}
