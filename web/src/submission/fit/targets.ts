/** Targets of a calibration. */

import type { CalibrationSpec, OptimizerPreset, RecordingView, RobotSource } from '../../api/types'
import { number } from '../draft/settings'
import { type FitDraft, fitOf } from './fit'
import type { Parameters } from './parameters'

export interface TargetDraft {
  readonly key: number
  readonly recording: string
  readonly quantity: string
  readonly value: string
  readonly tolerance: string
  readonly use: 'fit' | 'predict'
}

/** Currents of a log as targets; peaks contain noise and are only predicted. */
function targetsOf(recording: RecordingView, key: number): readonly TargetDraft[] {
  const { id, mean_current, peak_current } = recording
  const value = (current: number) => String(Number(current.toPrecision(4)))
  const [mean, peak] = [value(mean_current), value(peak_current)]
  return [
    { key, recording: id, quantity: 'mean_current', value: mean, tolerance: '0.1', use: 'fit' },
    {
      key: key + 1,
      recording: id,
      quantity: 'peak_current',
      value: peak,
      tolerance: '0.2',
      use: 'predict',
    },
  ]
}

export function withRecordings(
  targets: readonly TargetDraft[],
  added: readonly string[],
  recordings: readonly RecordingView[],
): readonly TargetDraft[] {
  const all = [...targets]
  for (const recording of recordings) {
    if (!added.includes(recording.id)) all.push(...targetsOf(recording, nextKey(all)))
  }
  return all
}

export function nextKey(targets: readonly TargetDraft[]): number {
  return Math.max(-1, ...targets.map(({ key }) => key)) + 1
}

export function walkName(index: number): string {
  return `walk-${index + 1}`
}

/** Only targets of the selected recordings are included. */
export function calibrationSpec(
  draft: FitDraft,
  parameters: Parameters,
  targets: readonly TargetDraft[],
  robot: RobotSource,
  recordings: readonly RecordingView[],
  methods: readonly OptimizerPreset[],
): CalibrationSpec {
  const places = new Map(recordings.map(({ id }, index) => [id, walkName(index)]))
  return {
    kind: 'calibration',
    robot,
    walks: recordings.map(({ controller, design, walk }, index) => ({
      name: walkName(index),
      controller,
      design,
      scenarios: [walk],
    })),
    targets: selectedTargets(targets, recordings).map(
      ({ recording, quantity, value, tolerance, use }) => ({
        walk: places.get(recording),
        quantity,
        value: number(value),
        tolerance: number(tolerance),
        use,
      }),
    ),
    ...fitOf(draft, parameters, methods),
  } as unknown as CalibrationSpec
}

export function selectedTargets(
  targets: readonly TargetDraft[],
  recordings: readonly RecordingView[],
): readonly TargetDraft[] {
  return targets.filter(({ recording }) => recordings.some(({ id }) => id === recording))
}
