/** New-identification form: parameters to fit to recordings. */

import { useMemo, useState } from 'preact/hooks'
import type { IdentificationSpec, OptimizerPreset, RobotSource } from '../../api/types'
import { TextField } from '../../components/fields/field'
import { number } from '../draft/settings'
import { EMPTY_FIT, type FitDraft, fitOf, words } from './fit'
import { FitForm } from './fit-form'
import type { FitProps } from './page'
import type { Parameters } from './parameters'

export function identificationSpec(
  draft: FitDraft,
  parameters: Parameters,
  links: string,
  robot: RobotSource,
  recordings: readonly string[],
  methods: readonly OptimizerPreset[],
): IdentificationSpec {
  return {
    kind: 'identification',
    robot,
    recordings,
    links: words(links).map(number),
    ...fitOf(draft, parameters, methods),
  } as unknown as IdentificationSpec
}

export function IdentificationForm({ catalogue, robot, fittable, ids }: FitProps) {
  const [draft, setDraft] = useState<FitDraft>({ ...EMPTY_FIT, name: 'identification' })
  const [links, setLinks] = useState('1, 2, 3')
  const parameters = { fittable: fittable.parameters, fittedByDefault: null, edited: draft.edited }
  const spec = useMemo(
    () => identificationSpec(draft, parameters, links, robot, ids, catalogue.optimizers),
    [draft, fittable, links, robot, ids.join(), catalogue],
  )
  return (
    <FitForm
      title="Identification"
      catalogue={catalogue}
      parameters={parameters}
      draft={draft}
      onDraft={(changes) => setDraft((old) => ({ ...old, ...changes }))}
      spec={spec}
      parts={['robot', 'recordings', '']}
    >
      {(errors) => (
        <TextField
          label="Links"
          value={links}
          hint="joints whose currents are compared: 1 coxa, 2 femur, 3 tibia"
          error={errors.links}
          onChange={setLinks}
        />
      )}
    </FitForm>
  )
}
