/** Tasks by worker as bars over time; those of one machine that overlap lie below each other. Pure. */

import type { Activity } from '../../api/types'

type Task = Activity['tasks'][number]

export interface Bar {
  readonly task: Task
  /** Since the first task that is shown [s]. */
  readonly begun: number
  readonly ended: number
  /** Of the time, how much the worker computed, 0 to 1. */
  readonly computed: number
}

/** Tasks that do not overlap. */
export type Lane = readonly Bar[]

interface WorkerLanes {
  readonly worker: string
  readonly lanes: readonly Lane[]
}

export interface Timeline {
  readonly workers: readonly WorkerLanes[]
  /** Where iterations begin, since the first task that is shown [s]. */
  readonly iterations: readonly { readonly iteration: number; readonly begun: number }[]
  /** Time that is shown [s]. */
  readonly seconds: number
}

/** The last tasks, at most `most` of them. */
export function timelineOf({ tasks, iterations }: Activity, most: number): Timeline {
  const shown = tasks.slice(-most).map((task) => ({ task, at: Date.parse(task.begun_at) / 1000 }))
  const first = Math.min(...shown.map(({ at }) => at))
  const bars = shown
    .map(({ task, at }): Bar => {
      const begun = at - first
      const computed = task.seconds > 0 ? Math.min(1, task.compute_seconds / task.seconds) : 1
      return { task, begun, ended: begun + task.seconds, computed }
    })
    .sort((a, b) => a.begun - b.begun)
  const names = [...new Set(bars.map(({ task }) => task.worker))].sort()
  const seconds = Math.max(0, ...bars.map(({ ended }) => ended))
  return {
    workers: names.map((worker) => ({
      worker,
      lanes: packed(bars.filter(({ task }) => task.worker === worker)),
    })),
    iterations: iterations
      .map(({ iteration, begun_at }) => ({ iteration, begun: Date.parse(begun_at) / 1000 - first }))
      .filter(({ begun }) => begun >= -TOUCH && begun <= seconds),
    seconds,
  }
}

/** Rounding of times must not push tasks that follow each other apart [s]. */
const TOUCH = 0.002

/** Each in the first lane that is free when it begins. */
function packed(bars: readonly Bar[]): readonly Lane[] {
  const lanes: Bar[][] = []
  for (const bar of bars) {
    const free = lanes.find((lane) => lane[lane.length - 1].ended <= bar.begun + TOUCH)
    if (free) free.push(bar)
    else lanes.push([bar])
  }
  return lanes
}
