/** Recorded walks. */

import { postBytes } from '../../api/client'
import type { Scenario } from '../../api/types'
import type { ResolvedDesign } from '../design/resolve-design'
import { parseReplay, type Replay } from './replay'

export type WalkingDesign = Pick<ResolvedDesign, 'label' | 'robot' | 'design' | 'world'> & {
  readonly controller: { readonly name: string }
}

export interface Recorded {
  readonly label: string
  readonly replay: Replay
}

/** Recording rates [Hz]: for the eye, the charts, the controller. */
export const RATES = [50, 100, 500] as const

export const DEFAULT_RATE = 100

/** Simulate a design in a scenario, given by preset name or in full. */
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
