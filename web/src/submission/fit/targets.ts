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

type Measured = Omit<TargetDraft, 'key' | 'recording'>

/** A walk of which figures are known, but no log. */
export interface TableWalk
  extends Pick<RecordingView, 'id' | 'controller' | 'design' | 'scenario'> {
  readonly walk: string
  readonly targets: readonly Measured[]
}

export type TargetWalk = RecordingView | TableWalk

/** Walks of a design by a table: scenario, quantity, value, and optionally tolerance and use. */
export function tableWalks(text: string, design: Pick<TableWalk, 'controller' | 'design'>) {
  const byScenario = new Map<string, Measured[]>()
  let problem: string | undefined
  for (const line of text.split('\n')) {
    const cells = line.split(/[,;\t]/).map((cell) => cell.trim())
    const [scenario, quantity = '', value = '', tolerance, use = 'fit'] = cells
    if (line.trim() === '' || line.startsWith('#') || scenario === 'scenario') continue
    if (cells.includes('controller')) {
      const other = 'gaitswarm calibrate reads tables with designs of their own; this one has one'
      return { walks: [], problem: `${other} design: scenario, quantity, value, tolerance, use` }
    }
    if (!value || (use !== 'fit' && use !== 'predict')) {
      problem ??= `“${line.trim()}” is not: scenario, quantity, value, tolerance, fit or predict`
      continue
    }
    const targets = byScenario.get(scenario) ?? []
    byScenario.set(scenario, targets)
    const name = quantity.replaceAll(' ', '_')
    targets.push({ quantity: name, value, tolerance: tolerance || '0.1', use })
  }
  const walks = [...byScenario].map(([scenario, targets]): TableWalk => {
    // Other targets are those of another walk, so that edited rows do not outlive them.
    const id = `table ${scenario} ${JSON.stringify(targets)}`
    return { ...design, id, scenario, walk: scenario, targets }
  })
  return { walks, problem }
}

/** Those of a table; or currents of a log, whose peaks contain noise and are only predicted. */
function targetsOf(recording: TargetWalk, key: number): readonly TargetDraft[] {
  if ('targets' in recording) {
    return recording.targets.map((each, k) => ({ ...each, key: key + k, recording: recording.id }))
  }
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
  recordings: readonly TargetWalk[],
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
  recordings: readonly TargetWalk[],
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
  recordings: readonly TargetWalk[],
): readonly TargetDraft[] {
  return targets.filter(({ recording }) => recordings.some(({ id }) => id === recording))
}
