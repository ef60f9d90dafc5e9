/** What went wrong with a request, in the API's own words (RFC 9457). */

export interface FieldError {
  /** Path of the field, parts joined by dots; empty for the request as a whole. */
  readonly field: string
  readonly message: string
}

/** The server answered with a problem, or could not be reached (status 0). */
export class ApiProblem extends Error {
  override readonly name = 'ApiProblem'

  constructor(
    /** HTTP status; 0 if there was no answer. */
    readonly status: number,
    /** What went wrong this time and what to do about it. */
    readonly detail: string,
    readonly errors: readonly FieldError[] = [],
  ) {
    super(detail)
  }

  /** Whether asking again later may help. */
  get temporary(): boolean {
    return this.status === 0 || this.status === 429 || this.status >= 500
  }
}

/** The problem that a response tells, whatever its body is. */
export async function problemOf(response: Response): Promise<ApiProblem> {
  const type = response.headers.get('content-type') ?? ''
  if (type.includes('json')) {
    const body = (await response.json().catch(() => null)) as Partial<ProblemBody> | null
    if (body && typeof body.detail === 'string') {
      return new ApiProblem(response.status, body.detail, body.errors ?? [])
    }
  }
  const reason = response.statusText || 'no reason given'
  return new ApiProblem(response.status, `the server answered ${response.status}: ${reason}`)
}

/** Any thrown value as a sentence for people. */
export function messageOf(error: unknown): string {
  return error instanceof Error ? error.message : String(error)
}

interface ProblemBody {
  detail: string
  errors: FieldError[]
}
