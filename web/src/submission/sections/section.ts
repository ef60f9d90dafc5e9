/** Props of all sections of the form. */

import type { FieldErrors } from '../draft/build-spec'
import type { Catalogue } from '../draft/catalogue'
import type { Draft } from '../draft/draft'

export interface SectionProps {
  readonly draft: Draft
  readonly catalogue: Catalogue
  readonly errors: FieldErrors
  readonly onChange: (changes: Partial<Draft>) => void
}
