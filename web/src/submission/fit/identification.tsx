/** The form of a new identification: which parameters are fitted to which recordings. */

import { useMemo, useState } from 'preact/hooks'
import type { IdentificationSpec, OptimizerPreset } from '../../api/types'
import { TextField } from '../text-field'
import { EMPTY_FIT, type FitDraft, fitOf, number, words } from './fit'
import { FitForm } from './fit-form'
import type { FitProps } from './page'

/** The spec of what was typed. */
export function identificationSpec(
  draft: FitDraft,
  links: string,
  robot: string,
  recordings: readonly string[],
  methods: readonly OptimizerPreset[],
): IdentificationSpec {
  return {
    kind: 'identification',
    robot,
    recordings,
    links: words(links).map(number),
    ...fitOf(draft, methods),
  } as unknown as IdentificationSpec
}

export function IdentificationForm({ catalogue, robot, onRobot, ids }: FitProps) {
  const [draft, setDraft] = useState<FitDraft>({ ...EMPTY_FIT, name: 'identification' })
  const [links, setLinks] = useState('1, 2, 3')
  const spec = useMemo(
    () => identificationSpec(draft, links, robot, ids, catalogue.optimizers),
    [draft, links, robot, ids.join(), catalogue],
  )
  return (
    <FitForm
      title="Identification"
      catalogue={catalogue}
      robot={robot}
      onRobot={onRobot}
      draft={draft}
      onDraft={(changes) => setDraft((old) => ({ ...old, ...changes }))}
      spec={spec}
      parts={['recordings', '']}
    >
      {(errors) => (
        <TextField
          label="Links"
          value={links}
          hint="whose currents are compared: 1 coxa, 2 femur, 3 tibia"
          error={errors.links}
          onChange={setLinks}
        />
      )}
    </FitForm>
  )
}
