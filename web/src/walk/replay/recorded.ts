/** A walk that was asked for: the design, and what was recorded of it. */

import { postBytes } from '../../api/client'
import type { Scenario } from '../../api/types'
import type { ResolvedDesign } from '../design/resolve-design'
import { parseReplay, type Replay } from './replay'

/** As much of a design as a walk needs. */
export type WalkingDesign = Pick<ResolvedDesign, 'label' | 'robot' | 'design' | 'world'> & {
  readonly controller: { readonly name: string }
}

export interface Recorded {
  readonly label: string
  readonly replay: Replay
}

/** Frames a second that can be asked for [Hz]: of the eye, of the charts, of the controller. */
export const RATES = [50, 100, 500] as const

export const DEFAULT_RATE = 100

export function replaysOf(walks: readonly Recorded[]): Replay[] {
  return walks.map(({ replay }) => replay)
}

/** Let a design walk through a scenario, a preset's name or one of one's own. */
export async function recordWalk(
  { label, robot, controller, design, world = {} }: WalkingDesign,
  scenario: string | Scenario,
  rate: number,
  signal: AbortSignal,
): Promise<Recorded> {
  const name = controller.name as 'fuzzy-pi'
  const body = {
    robot,
    controller: name,
    design: { ...design },
    world: { ...world },
    scenario,
    rate,
  }
  return { label, replay: parseReplay(await postBytes('/v1/replays', { body, signal })) }
}
